"""The short film of the README: a recorded clip beside what its scene shows, over time.

    python -m dreamdrive_bench film OUT pandaset_002/front_camera --fps 10 --frames 20:68:2 --size 480x270

of the folder that ``headline`` takes writes ``docs/images/film.webp``. Panels are so small that neither faces
nor plates can be read.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
from PIL import Image as Pillow

from dreamdrive.data import read_clip
from dreamdrive.drive import manoeuvre
from dreamdrive.files.output import new_file
from dreamdrive.scene.scene import Scene
from dreamdrive.show import Image, depth_colours, grid
from dreamdrive.splat import render_scene
from dreamdrive.stored import load_scene
from dreamdrive_bench.common.options import size_of
from dreamdrive_bench.common.places import ROOT
from dreamdrive_bench.headline import standing_out

FILM = ROOT / "docs/images/film.webp"
MOST_BYTES = 2_000_000
RATE_HZ = 8
"""Pictures a second of films."""
_PANEL_PX = 320


def main() -> None:
    """Draw it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", type=Path, help="folder that generate wrote")
    parser.add_argument("recording", type=Path)
    parser.add_argument("--frames", default=None, metavar="START:STOP:STEP")
    parser.add_argument("--fps", type=float, default=None)
    parser.add_argument("--size", type=size_of, default=(480, 270), metavar="WxH")
    parser.add_argument("--shift-m", type=float, default=-2.0, help="to the right; negative is to the left")
    parser.add_argument("-o", "--output", type=Path, default=FILM)
    args = parser.parse_args()
    clip = read_clip(args.recording, frames=args.frames, fps=args.fps, size=args.size)
    frames = film(load_scene(args.out / "scene"), clip.frames, args.shift_m)
    write(args.output, frames)
    print(f"{args.output}: {len(frames)} frames, {args.output.stat().st_size:,} bytes")


def film(scene: Scene, recorded: np.ndarray, shift_m: float) -> list[Image]:
    """The panels at each recorded time."""
    aside = manoeuvre("shift", scene.trajectory, scene.up, shift_m)
    side = f"from {abs(shift_m):g} m to the {'left' if shift_m < 0 else 'right'}"
    frames: list[Image] = []
    for frame, camera, t_s, pose in zip(
        recorded, scene.cameras, scene.times_s, aside.world_from_camera, strict=True
    ):
        here, there = (
            render_scene(scene, camera, float(t_s)),
            render_scene(scene, camera.at(pose), float(t_s)),
        )
        street = render_scene(scene, camera, float(t_s), part="static")
        made = {
            "recorded": frame,
            side: there.picture,
            "the street alone": street.picture,
            "what moves, found without labels": standing_out(here),
            "depth": depth_colours(here.depth_m.numpy()),
            "depth from there": depth_colours(there.depth_m.numpy()),
        }
        frames.append(grid({name: small(image) for name, image in made.items()}, 2))
    return frames


def small(image: Image) -> Image:
    """A panel."""
    height = round(_PANEL_PX * image.shape[0] / image.shape[1])
    return cv2.resize(image, (_PANEL_PX, height), interpolation=cv2.INTER_AREA)


def write(path: Path, frames: list[Image]) -> None:
    """As WebP that repeats itself, as good as ``MOST_BYTES`` allow."""
    pictures = [Pillow.fromarray(frame) for frame in frames]
    for quality in range(80, 20, -10):
        with new_file(path) as partial:
            pictures[0].save(
                partial, "WEBP", save_all=True, append_images=pictures[1:], loop=0, quality=quality,
                duration=1000 // RATE_HZ, method=4,
            )  # fmt: skip
        if path.stat().st_size <= MOST_BYTES:
            return
