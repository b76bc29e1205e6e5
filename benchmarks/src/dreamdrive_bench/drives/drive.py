"""The list of drives, and the clip of each."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dreamdrive.prior import choose_prior
from dreamdrive.progress import Work
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive_bench.common.places import DATA

HOLD_OUT = 8
BROUGHT = Path("runs/data")
"""Where ``bring`` puts the drives that do not lie in ``DATA``, from the working folder."""


@dataclass(frozen=True)
class Drive:
    """A piece of a recording and how it is read.

    Attributes:
        name: In tables.
        place: Folder below ``DATA`` or ``BROUGHT``, with the recording's ``meta.json``.
        source: The video or the folder of frames in it.
        frames: ``START:STOP:STEP``.
        fps: Rate of the source; None where it says so itself.
        size: Width and height in pixels.
        camera_height_m: Where it is known.
        truth: What is known of poses and of what moves, see ``drives.truth``; None for nothing.
        lidar: Name of the file with the lidar points of a frame of the source.
    """

    name: str
    place: str
    source: str
    frames: str
    size: tuple[int, int]
    fps: float | None = None
    camera_height_m: float | None = None
    truth: str | None = None
    lidar: str | None = None

    @property
    def folder(self) -> Path:
        """Where it is, or should be."""
        found = DATA / self.place
        return found if found.exists() else BROUGHT / self.place

    @property
    def meta(self) -> dict[str, Any]:
        """What is known of the recording."""
        return json.loads((self.folder / "meta.json").read_text())

    def clip(self) -> Clip:
        """The frames; nothing else that is known is used."""
        control = Control(
            path=self.folder / self.source,
            frames=self.frames,
            fps=self.fps,
            size=self.size,
            hold_out=HOLD_OUT,
        )
        return choose_prior("replay")(control, Work())


def drives() -> dict[str, Drive]:
    """All drives by name, in the order of tables."""
    listed = json.loads((Path(__file__).parent / "list.json").read_text())
    return {one["name"]: Drive(**{**one, "size": tuple(one["size"])}) for one in listed}
