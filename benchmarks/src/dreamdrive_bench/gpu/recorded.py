"""The clip of the pack: 24 frames of PandaSet at two sizes, with geometry as a run finds it."""

from pathlib import Path

from dreamdrive.prior import PRIORS
from dreamdrive.scene.control import Control
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.gpu.fits import LARGE, SMALL
from dreamdrive_bench.gpu.pack import found, save_pack


def make_pack(folder: Path) -> None:
    """Find the geometry at both sizes and write the pack: some minutes on two cores."""
    recording = DATA / "clips/pandaset_002/front_camera"
    controls = [
        Control(recording, frames="20:68:2", fps=10, size=size, hold_out=8) for size in (SMALL, LARGE)
    ]
    clips = [PRIORS["replay"](control) for control in controls]
    save_pack(folder, [(clip, found(clip)) for clip in clips])
