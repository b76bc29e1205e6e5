"""Novel trajectories of a scene and their renders: pictures at the recorded times, never a video."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.source import open_source
from dreamdrive.drive import MANOEUVRES, Drive, drives_of
from dreamdrive.errors import InputError
from dreamdrive.evaluate import read_frames
from dreamdrive.files.digest import digest
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.show import RenderOptions, write_drive, write_png
from dreamdrive_bench.common.keep import is_current, save
from dreamdrive_bench.table1.scenes import Made

RECORDED = "forward"
"""The recorded path, where nothing is novel."""
SHIFTS = {"shift-left": -1, "shift-right": 1}
"""Sides that ``shift`` stands for; positive is to the right."""
NOVEL = (*SHIFTS, *(name for name in MANOEUVRES if name not in (RECORDED, "shift")))
"""All trajectories that can be chosen."""


@dataclass(frozen=True)
class Pictures:
    """A folder of pictures, and the digest of what they follow from."""

    folder: Path
    key: str

    def read(self) -> UInt8[np.ndarray, "f h w 3"]:
        """All of them."""
        return read_frames(open_source(self.folder))


def chosen(names: Sequence[str]) -> list[str]:
    """Trajectories by the names of the command line; ``shift`` is both sides."""
    found: list[str] = []
    for name in (each.replace("_", "-") for each in names):
        if name not in ("shift", *NOVEL):
            known = ", ".join(("shift", *NOVEL))
            raise InputError(f"--trajectories {name}: unknown; expected some of {known}")
        found += SHIFTS if name == "shift" else [name]
    if not found:
        raise InputError("--trajectories: expected one or more")
    return list(dict.fromkeys(found))


def trajectory(scene: Scene, name: str, shift_m: float) -> Trajectory:
    """A drive at the recorded times; ``InputError`` where the scene has not seen what lies along it."""
    side = SHIFTS.get(name, 0)
    drive = drives_of(scene, ["shift" if side else name], side * shift_m, None)[0]
    times_s = scene.trajectory.times_s
    return Trajectory(drive.path.at(times_s), times_s)


def rendered(made: Made, representation: str, name: str, shift_m: float, runs: Path) -> Pictures:
    """The pictures of a drive, from the disk if they are there."""
    key = digest([made.key, name, shift_m if name in SHIFTS else None])
    folder = runs / "rendered" / representation / f"{made.folder.parent.name}-{name}"
    about = folder.with_name(f"{folder.name}.json")
    if not (is_current(about, key) and folder.exists()):
        about.unlink(missing_ok=True)
        folder.parent.mkdir(parents=True, exist_ok=True)
        scene = made.load()
        drive = Drive(name, trajectory(scene, name, shift_m))
        write_drive(folder, scene, drive, RenderOptions(format="png"), lambda done: None)
        save(about, key, {})
    return Pictures(folder, key)


def kept_real(frames: UInt8[np.ndarray, "f h w 3"], folder: Path) -> Pictures:
    """Recorded pictures as PNG, so that both sets are read alike."""
    key = digest(frames)
    about = folder.with_name(f"{folder.name}.json")
    if not (is_current(about, key) and folder.exists()):
        about.unlink(missing_ok=True)
        folder.mkdir(parents=True, exist_ok=True)
        for old in folder.glob("*.png"):
            old.unlink()
        for i, frame in enumerate(frames):
            write_png(folder / f"{i:04d}.png", frame)
        save(about, key, {})
    return Pictures(folder, key)
