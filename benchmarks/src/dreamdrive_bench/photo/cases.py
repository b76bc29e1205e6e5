"""Pictures to begin from, and what was truly seen later and from aside."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.photo import read_photo
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.photo.ways import Sight, Start
from dreamdrive_bench.recorded.pandaset import camera_path, pinhole
from streetworld import make_street

SIZE = (480, 270)
RATE_HZ = 10.0
AHEAD_S = (0.5, 1.0, 2.0)
STREET_HZ = 2.0
FRAMES = round(AHEAD_S[-1] * STREET_HZ) + 1
HEIGHTS_M = (1.2, 2.1)
"""From which the camera's height in a drawn street is drawn."""
ASIDE_M = 1.0
PANDASET_STARTS = range(20, 60, 4)
"""Frames of the moving part from which two seconds are left."""
PANDASET_HEIGHT_M = 2.2


@dataclass(frozen=True)
class Case:
    """One picture and what is to be told from it; ``made`` is the truth of a drawn street."""

    name: str
    start: Start
    sights: list[Sight]
    made: DriveTruth | None = None


def drawn(seed: int) -> Case:
    """A street of edition 2; its lens is told to nobody."""
    tall_m = float(np.random.default_rng([seed, 24]).uniform(*HEIGHTS_M))
    made = make_street(seed, FRAMES, STREET_HZ, SIZE, camera_height_m=tall_m, edition=2)
    camera = made.cameras[0]
    height_m = abs(float(made.ground.height_m(camera.world_from_camera[:3, 3])))
    sights = [
        Sight(f"{s:g} s", s, made.cameras[k].world_from_camera, made.frames[k])
        for s, k in ((s, round(s * STREET_HZ)) for s in AHEAD_S)
    ]
    for side in (-1, 1):
        pose = np.eye(4)
        pose[0, 3] = side * ASIDE_M
        sights.append(Sight("1 m aside", 0.0, pose, made.views([camera.at(pose)], [0.0])[0].frame))
    return Case(f"street {seed}", Start(made.frames[0], camera, height_m, calibrated=False), sights, made)


def pandaset() -> Iterator[Case]:
    """Frames of the clip's moving part, with its calibration and poses."""
    folder = DATA / "clips/pandaset_002"
    matrix = pinhole(folder, SIZE)
    camera = Camera(matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *SIZE)
    for first in PANDASET_STARTS:
        frames = [first, *(first + round(s * RATE_HZ) for s in AHEAD_S)]
        poses = camera_path(folder, frames)
        pictures = [_picture(folder / "front_camera", frame) for frame in frames]
        ahead = zip(AHEAD_S, np.linalg.inv(poses[0]) @ poses[1:], pictures[1:], strict=True)
        sights = [Sight(f"{s:g} s", s, pose, rgb) for s, pose, rgb in ahead]
        start = Start(pictures[0], camera, PANDASET_HEIGHT_M, calibrated=True)
        yield Case(f"pandaset {first}", start, sights)


def _picture(folder: Path, frame: int) -> UInt8[np.ndarray, "h w 3"]:
    return read_photo(sorted(folder.glob("*.jpg"))[frame], SIZE).rgb
