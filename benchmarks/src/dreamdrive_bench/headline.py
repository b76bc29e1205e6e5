"""The picture of the README: one moment of a clip, as recorded and as the scene of it shows.

    dreamdrive generate pandaset_002/front_camera --fps 10 --frames 20:68:2 --size 480x270 --camera-height 2.2
        --hold-out 8 --knowledge benchmarks/knowledge/twin.safetensors -o OUT
    python -m dreamdrive_bench headline OUT pandaset_002/front_camera --fps 10 --frames 20:68:2 --size 480x270

draws a frame that no fit has seen, its prediction, a view from aside, what moves, the street alone and depth
into ``docs/images``. Frames are so small that neither faces nor plates can be read.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

from dreamdrive.data import read_clip
from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.drive import manoeuvre
from dreamdrive.files.output import new_file
from dreamdrive.scene.scene import Scene
from dreamdrive.show import Image, depth_colours, grid
from dreamdrive.splat import SceneView, render_scene
from dreamdrive.stored import load_scene
from dreamdrive_bench.common.options import size_of
from dreamdrive_bench.common.places import ROOT

PICTURE = ROOT / "docs/images/pandaset.jpg"
_QUALITY, _COLUMNS = 88, 3


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
    parser.add_argument("--frame", type=int, default=None, metavar="N", help="which of the withheld frames")
    parser.add_argument(
        "--blur", nargs="*", default=[], metavar="X,Y,W,H", help="plates, in pixels of the frame"
    )
    parser.add_argument("-o", "--output", type=Path, default=PICTURE)
    args = parser.parse_args()
    scene = load_scene(args.out / "scene")
    clip = read_clip(args.recording, frames=args.frames, fps=args.fps, size=args.size)
    held = np.flatnonzero(scene.held_out)
    at = int(held[-1 if args.frame is None else args.frame])
    made = panels(scene, clip.frames[at], at, args.shift_m)
    for name, image in made.items():
        for box in args.blur if not name.startswith("from ") else ():
            blur(image, *map(int, box.split(",")))
    picture = grid(made, columns=_COLUMNS)
    with new_file(args.output) as partial:
        write_picture(partial, picture[..., ::-1], quality=_QUALITY)
    print(f"{args.output}: {picture.shape[1]}x{picture.shape[0]}")


def panels(scene: Scene, recorded: Image, at: int, shift_m: float) -> dict[str, Image]:
    """The pictures by what they are called."""
    here, t_s = scene.cameras[at], float(scene.times_s[at])
    aside = manoeuvre("shift", scene.trajectory, scene.up, shift_m)
    row = int(np.abs(aside.times_s - t_s).argmin())
    away = here.at(aside.world_from_camera[row])
    side = "left" if shift_m < 0 else "right"
    seen, moved = render_scene(scene, here, t_s), render_scene(scene, away, t_s)
    street = render_scene(scene, here, t_s, part="static")
    return {
        "recorded, not seen by the fit": recorded,
        "predicted": seen.picture,
        f"from {abs(shift_m):g} m to the {side}": moved.picture,
        "what moves, found without labels": standing_out(seen),
        "the street alone": street.picture,
        "depth": depth_colours(seen.depth_m.numpy()),
    }


def standing_out(view: SceneView) -> Image:
    """What moves in colour, all else grey and darker."""
    grey = cv2.cvtColor(cv2.cvtColor(view.picture, cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
    return np.where(view.dynamic.numpy()[..., None], view.picture, (0.6 * grey).astype(np.uint8))


def blur(image: Image, left: int, top: int, width: int, height: int) -> None:
    """Make a part of a picture unreadable, in place."""
    part = image[top : top + height, left : left + width]
    part[:] = cv2.blur(part, (width, height))
