"""Drawn streets as a clip, and as files with known cameras."""

import json
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.cameras.intrinsics import guess_camera
from dreamdrive.data.frames.select import held_out_mask
from dreamdrive.files.output import new_file
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.street.truth import DriveTruth


def drawn_clip(
    made: DriveTruth,
    frames: UInt8[np.ndarray, "f h w 3"] | None = None,
    known: Known | None = None,
    hold_out: int | None = None,
) -> Clip:
    """The frames of a drawn street.

    Args:
        made: The drive.
        frames: What is to be seen in place of its own frames.
        known: What is told of the geometry; the lens is a guess where that is no part of it.
        hold_out: Every how many frames one is held out; None withholds none.
    """
    known = known or Known()
    count, height, width = made.frames.shape[:3]
    pinhole = made.cameras[0].at(np.eye(4)) if known.intrinsics else guess_camera((width, height)).camera
    return Clip(
        frames=made.frames if frames is None else frames,
        times_s=made.times_s,
        camera=np.zeros(count, dtype=np.int64),
        rig=(pinhole,),
        valid=np.ones((count, height, width), dtype=bool),
        held_out=held_out_mask(count, hold_out),
        source_index=np.arange(count),
        known=known,
    )


def write_cameras(made: DriveTruth, path: Path) -> None:
    """The true cameras of a drive in our own format, which counts pixels by integer index."""
    camera = made.cameras[0]
    middle = {"cx": camera.cx_px - 0.5, "cy": camera.cy_px - 0.5}
    record = {
        "width": camera.width_px,
        "height": camera.height_px,
        "intrinsics": {"fx": camera.fx_px, "fy": camera.fy_px, **middle},
        "world_from_camera": [each.world_from_camera.tolist() for each in made.cameras],
    }
    with new_file(path) as partial:
        partial.write_text(json.dumps(record))
