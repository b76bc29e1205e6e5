"""The pictures of the stages' pages, of a drawn street: what goes into each stage and what comes out.

    python -m dreamdrive_bench illustrations [--seed 5]

makes a scene of a street and writes ``docs/images/stage_NAME.jpg``.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor

from dreamdrive import Control, Options, Scene, build_scene, render_scene
from dreamdrive.build import Built
from dreamdrive.decompose import error_maps
from dreamdrive.drive import manoeuvre
from dreamdrive.files.output import new_file
from dreamdrive.options import QUALITIES
from dreamdrive.prior import PRIORS
from dreamdrive.show import Image, depth_colours, grid
from dreamdrive.splat import render
from dreamdrive_bench.common.places import ROOT
from dreamdrive_bench.headline import standing_out

FOLDER = ROOT / "docs/images"
MOST_BYTES = 80_000
_FRAMES, _SIZE, _AT = "0:24", (480, 270), 11
"""The moment is no withheld one: those have no depth and no errors."""


def main() -> None:
    """Make the scene and draw it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--quality", choices=QUALITIES, default="draft")
    args = parser.parse_args()
    clip = PRIORS["street-world"](
        Control(frames=_FRAMES, size=_SIZE, seed=args.seed, hold_out=8), lambda done, total: None
    )
    options: Options = QUALITIES[args.quality]
    built = build_scene(clip, options, seed=args.seed)
    for name, (panels, columns) in pictures(built, options.group.threshold).items():
        write(FOLDER / f"stage_{name}.jpg", grid(panels, columns))


def pictures(built: Built, tau: float) -> dict[str, tuple[dict[str, Image], int]]:
    """Panels and columns of each picture."""
    clip, scene, geometry = built.clip, built.scene, built.geometry
    camera, t_s, frame = scene.cameras[_AT], float(scene.times_s[_AT]), clip.frames[_AT]
    seen = render_scene(scene, camera, t_s)
    errors = error_maps(clip, geometry, built.static.pictures(clip, geometry))[_AT]
    parts = {part: render_scene(scene, camera, t_s, part=part).picture for part in ("static", "dynamic")}
    shift = camera.at(manoeuvre("shift", scene.trajectory, scene.up, -2.0).world_from_camera[_AT])
    aside = render_scene(scene, shift, t_s)
    scores = scores_seen(built, tau)
    return {
        "prior": ({f"frame {k}": clip.frames[k] for k in (0, _AT, 23)}, 3),
        "geometry": (
            {
                "frame": frame,
                "depth": depth_colours(geometry.depth_m[_AT]),
                "confidence": coloured(geometry.confidence[_AT], cv2.COLORMAP_VIRIDIS),
                "evidence of motion": coloured(geometry.moving[_AT], cv2.COLORMAP_HOT),
            },
            2,
        ),
        "score": (
            {
                "error of the static fit": coloured(errors / 0.2, cv2.COLORMAP_HOT),
                "dynamic score": coloured(scores, cv2.COLORMAP_HOT),
            },
            2,
        ),
        "cluster": ({"votes, each for itself": over(frame, scores > tau), "actors": actors(scene)}, 2),
        "decompose": ({"static": parts["static"], "dynamic": parts["dynamic"]}, 2),
        "fit": ({"recorded": frame, "rendered": seen.picture}, 2),
        "splat": ({"2 m to the left": aside.picture, "its depth": depth_colours(aside.depth_m.numpy())}, 2),
        "drive": (drives(scene), 3),
    }


def scores_seen(built: Built, tau: float) -> np.ndarray:
    """Scores as a camera sees them: of what moves only copies from frames beside it (eq. 8)."""
    assert built.scores is not None
    gaussians, near = built.static.gaussians, torch.tensor([_AT - 1, _AT, _AT + 1])
    rows = torch.nonzero(torch.isin(gaussians.source_frame, near) | (built.scores <= tau)).squeeze(1)
    shown: Tensor = built.scores[rows][:, None]
    with torch.no_grad():
        drawn = render(gaussians.select(rows), built.geometry.cameras[_AT], channels=shown, sh_degree=0)
    return drawn.channels[..., 0].numpy()


def actors(scene: Scene) -> Image:
    """The street with a colour for each actor."""
    camera, t_s = scene.cameras[_AT], float(scene.times_s[_AT])
    picture = standing_out(render_scene(scene, camera, t_s))
    for place, actor in enumerate(scene.actors):
        others = [each.id for each in scene.actors if each.id != actor.id]
        alone = scene
        for other in others:
            alone = alone.without(other)
        covered = render_scene(alone, camera, t_s).dynamic.numpy()
        hue = np.uint8([[[(37 * place) % 180, 200, 255]]])
        colour = cv2.cvtColor(hue, cv2.COLOR_HSV2RGB)[0, 0]
        picture[covered] = (0.5 * picture[covered] + 0.5 * colour).astype(np.uint8)
    return picture


def drives(scene: Scene) -> dict[str, Image]:
    """One moment of drives that nobody recorded."""
    path, made = scene.trajectory, {}
    for name in ("forward", "shift", "lane-left", "left", "right", "stop"):
        pose = manoeuvre(name, path, scene.up, -2.0).world_from_camera[_AT]
        made[name] = render_scene(scene, scene.cameras[0].at(pose), float(path.times_s[_AT])).picture
    return made


def coloured(share: np.ndarray, colours: int) -> Image:
    """A share in [0, 1] by a table of colours."""
    levels = np.rint(np.clip(share, 0, 1) * 255).astype(np.uint8)
    return cv2.cvtColor(cv2.applyColorMap(levels, colours), cv2.COLOR_BGR2RGB)


def over(frame: Image, mask: np.ndarray) -> Image:
    """Pixels of a mask in red over a grey frame."""
    grey = cv2.cvtColor(cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
    return np.where(mask[..., None], np.uint8([255, 60, 40]), (0.7 * grey).astype(np.uint8))


def write(path: Path, picture: Image) -> None:
    """As JPEG, as good as ``MOST_BYTES`` allow."""
    for quality in range(90, 20, -5):
        done, data = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
        if done and len(data) <= MOST_BYTES:
            break
    with new_file(path) as partial:
        partial.write_bytes(data.tobytes())
    print(f"{path}: {picture.shape[1]}x{picture.shape[0]}, {path.stat().st_size:,} bytes")
