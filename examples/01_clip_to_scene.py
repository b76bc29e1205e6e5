"""From a clip to a scene, and a view nobody recorded.

    python examples/01_clip_to_scene.py [CLIP] [--out DIR]

A `Control` says what to read: a video or a folder of images, which frames, which size. `generate` runs the
pipeline and leaves a folder with the scene, videos and a report; called again it returns at once.
`load_scene` brings the scene back, and `render_scene` draws it from any camera, at recorded times and
between.

Without a clip the built-in street is used, small and as a draft: about a minute on two cores.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

from dreamdrive import Control, generate, load_scene, render_scene


def main() -> None:
    """Make a scene and look at it from one metre to the right."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("clip", nargs="?", type=Path)
    arguments.add_argument("--out", type=Path, default=Path("out/01_clip_to_scene"))
    given = arguments.parse_args()

    if given.clip is None:
        control, prior = Control(frames="0:12:1", size=(160, 96), hold_out=4), "street-world"
    else:
        control, prior = Control(given.clip, hold_out=8), "replay"
    generate(control, given.out, prior=prior, options="draft", progress=show)

    scene = load_scene(given.out / "scene")
    print(
        f"\n{len(scene.static)} static and {len(scene.dynamic)} dynamic Gaussians, {len(scene.actors)} actors"
    )

    # The camera of the middle frame, one metre to the right: axes are x right, y down, z forward, in metres.
    middle = len(scene.cameras) // 2
    view = render_scene(scene, scene.cameras[middle].moved(right_m=1.0), float(scene.times_s[middle]))

    picture = np.rint(view.colour.numpy() * 255).astype(np.uint8)
    path = given.out.parent / f"{given.out.name}_one_metre_right.png"
    cv2.imwrite(str(path), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    print(f"{100 * float(view.dynamic.float().mean()):.1f} % of the view moves; it is in {path}")


def show(stage: str, done: int, total: int) -> None:
    """One line a stage."""
    if total and done == total:
        print(stage, end=" ", flush=True)


if __name__ == "__main__":
    main()
