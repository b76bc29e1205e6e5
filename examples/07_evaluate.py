"""How good a scene is: its pictures beside the recorded ones, and what moves beside the truth.

    python examples/07_evaluate.py [--out DIR]

`evaluate_video` compares two sets of clips: PSNR and SSIM of paired frames, and the distances of which the
weights are there: FID, KID, FVD and KVD with files of yours, relatives of them with weights from small
packages (extra `metrics`). What it could not compute it names with the reason. On drawn streets
`evaluate_decomposition` knows what really moves.

Twelve frames are enough to try it, and far too few for a figure that means something.
"""

import argparse
from pathlib import Path

from small import small_scene, small_street

from dreamdrive import load_scene
from dreamdrive.drive import Drive
from dreamdrive.evaluate import VideoSettings, evaluate_decomposition, evaluate_video, read_truth
from dreamdrive.show import RenderOptions, write_drive


def main() -> None:
    """Render the recorded drive, and compare."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--out", type=Path, default=Path("out/07_evaluate"))
    out = arguments.parse_args().out

    street, scene = small_street(out.parent), load_scene(small_scene(out.parent) / "scene")
    write_drive(
        out, scene, Drive("recorded", scene.trajectory), RenderOptions(format="png"), lambda done: None
    )
    report = evaluate_video(street / "frames", out, VideoSettings(window=0, resamples=100))
    for name, figure in {**report.likenesses, **report.distances}.items():
        print(f"{name:12} {figure.value:8.3f}")
    for name, reason in report.not_computed.items():
        print(f"{name:12} not computed: {reason}")

    found = evaluate_decomposition(scene, read_truth(scene, street))
    print(f"what moves overlaps with the truth by an IoU of {found.mask.iou:.2f}")


if __name__ == "__main__":
    main()
