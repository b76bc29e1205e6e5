"""One way of getting geometry on one clip whose cameras and depth are known."""

import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from dreamdrive.data.clip_reader import read_clip
from dreamdrive.evaluate import Estimate, GeometryTruth, evaluate_geometry, of_drive, read_geometry_truth
from dreamdrive.geometry import GeometryOptions, reconstruct
from dreamdrive.geometry.backends.files import attach
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_bench.common.drawn import drawn_clip, write_cameras
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.geometry.cases import Measurement, Row
from dreamdrive_bench.geometry.worlds import world_of

FRAMES, RATE_HZ, SIZE = 24, 10.0, (320, 192)

Way = Literal["classical", "files"]


@dataclass(frozen=True)
class Recording:
    """A recorded clip below ``clips/``, and how it is read.

    Attributes:
        clip: Its folder.
        source: Folder of frames in it.
        poses: File in it with known cameras.
        frames: Which frames.
        size: Width and height in pixels.
        camera_height_m: Height of the camera above the road.
        intrinsics: File in it with a calibration that is given to all ways; None gives none.
    """

    clip: str
    source: str
    poses: str
    frames: str
    size: tuple[int, int]
    camera_height_m: float
    intrinsics: str | None = None


RECORDINGS = {
    "PandaSet 002": Recording("pandaset_002", "front_camera", "cameras.json", "20:68:2", (480, 270), 2.2),
    "KITTI 04": Recording(
        "kitti_odom04_follow_van", "frames", "poses.txt", "0:48:2", (480, 144), 1.65, "meta.json"
    ),
}
UNCALIBRATED = "KITTI 04, lens unknown"
"""A recording whose poses come without a calibration: its ``files`` would lack one."""
RECORDINGS[UNCALIBRATED] = replace(RECORDINGS["KITTI 04"], intrinsics=None)
STREETS: dict[str, tuple[str, int | None]] = {
    "street, static": ("straight b", 0),
    "street, traffic": ("straight b", None),
    "bend, traffic": ("bend a", None),
}
"""Drawn streets: world and number of movers, None as the seed has it. No calibration is given."""


@dataclass(frozen=True)
class BackendRun(Measurement):
    """A clip, and a way of getting its geometry.

    Attributes:
        clip: Name in ``RECORDINGS`` or ``STREETS``.
        way: ``classical`` finds cameras and depth; ``files`` is told the true cameras.
    """

    clip: str
    way: Way

    @property
    def name(self) -> str:
        """For messages and files."""
        return f"backend-{self.clip}-{self.way}".replace(" ", "_").replace(",", "")

    @property
    def case(self) -> Row:
        """The clip, how it is read or drawn, and the way."""
        if self.clip in RECORDINGS:
            made = {**asdict(RECORDINGS[self.clip]), "fps": RATE_HZ}
        else:
            world, movers = STREETS[self.clip]
            made = {"world": world, "movers": movers, "frames": FRAMES, "fps": RATE_HZ, "size": SIZE}
        return {"clip": self.clip, "way": self.way, "settings": made}

    def measure(self, runs: Path) -> Row:
        """The figures of docs/reference/evaluate_geometry.md, and processor seconds of all threads."""
        given = self._recorded() if self.clip in RECORDINGS else self._drawn(runs)
        clip = given.clip
        began = time.process_time()
        attached = clip if given.files is None else attach(clip, given.files)
        geometry = reconstruct(attached, GeometryOptions(camera_height_m=given.camera_height_m))
        seconds = time.process_time() - began
        estimate = Estimate.of(geometry, clip.times_s, index=clip.source_index, source=given.source)
        figures = evaluate_geometry(estimate, truth_of(given.truth, estimate))
        size = f"{clip.size[0]}x{clip.size[1]}"
        told = {"size": size, "calibrated": attached.known.intrinsics, "seconds": seconds}
        return {**told, **asdict(figures)}

    def _recorded(self) -> "_Given":
        how = RECORDINGS[self.clip]
        folder = DATA / "clips" / how.clip
        clip = read_clip(
            folder / how.source,
            frames=how.frames,
            fps=RATE_HZ,
            size=how.size,
            intrinsics=folder / how.intrinsics if how.intrinsics else None,
        )
        files = folder / how.poses if self.way == "files" else None
        return _Given(clip, files, how.camera_height_m, folder, how.source)

    def _drawn(self, runs: Path) -> "_Given":
        world, movers = STREETS[self.clip]
        made = world_of(world, FRAMES, RATE_HZ, SIZE, movers)
        files = runs / "files" / f"{self.name}.json" if self.way == "files" else None
        if files is not None:
            write_cameras(made, files)
        return _Given(drawn_clip(made), files, None, made, None)


@dataclass(frozen=True)
class _Given:
    """A clip, what is told of it, and what is known.

    Attributes:
        clip: The frames.
        files: Cameras that are told.
        camera_height_m: Height of the camera above the road; None tells nothing.
        truth: A recording's folder, or the drive itself.
        source: Name of the recording's folder of frames.
    """

    clip: Clip
    files: Path | None
    camera_height_m: float | None
    truth: Path | DriveTruth
    source: str | None


def truth_of(known: Path | DriveTruth, estimate: Estimate) -> GeometryTruth:
    """What is known of the frames of an estimate."""
    if isinstance(known, Path):
        return read_geometry_truth(known, estimate)
    return of_drive(known, estimate, Path("the drawn street"))
