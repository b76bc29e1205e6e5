"""What the street benchmark fits: seeded worlds, seen and understood in several ways."""

import hashlib
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Literal

import numpy as np
from jaxtyping import UInt8

from dreamdrive.files.digest import digest
from dreamdrive.prior import appearance
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_bench.common.drawn import drawn_clip
from dreamdrive_bench.common.worlds import EDITION
from streetworld import make_street
from streetworld.corruption import corrupt, parse_corruption

FRAMES, RATE_HZ, SIZE, HOLD_OUT = 24, 10.0, (320, 192), 8
Poses = Literal["true", "estimated", "unknown_focal"]
References = Literal["clean", "corrupted"]
VIEWS = ("held_out", "shift_1", "shift_2", "shift_3", "raise_1", "yaw_10")
NOVEL = VIEWS[1:]


@dataclass(frozen=True)
class Case:
    """One world, known in one way, seen in one way."""

    seed: int
    geometry: Poses
    references: References

    @property
    def name(self) -> str:
        """For files."""
        return f"{self.seed}-{self.geometry}-{self.references}"


@lru_cache(maxsize=2)
def world_of(seed: int) -> DriveTruth:
    """The drive of a seed."""
    return make_street(seed, FRAMES, RATE_HZ, SIZE, edition=EDITION)


@cache
def world_digest(seed: int) -> str:
    """Of the drive as it is drawn: another layout, path or renderer gives another one."""
    made = world_of(seed)
    drawn = hashlib.sha256(made.frames.tobytes() + made.depth_m.tobytes() + made.moving.tobytes())
    poses = made.trajectory.world_from_camera.tolist()
    return digest([drawn.hexdigest(), poses, made.times_s.tolist(), made.cameras[0].fx_px])


@lru_cache(maxsize=2)
def references_of(seed: int, references: References) -> UInt8[np.ndarray, "f h w 3"]:
    """The frames that a scene is made from."""
    made = world_of(seed)
    if references == "clean":
        return made.frames
    return corrupt(made.frames, parse_corruption("generated", seed), made.depth_m)


@cache
def references_digest(seed: int, references: References) -> str:
    """Of the frames that a scene is made from, and of the drive behind them."""
    frames = hashlib.sha256(references_of(seed, references).tobytes()).hexdigest()
    return digest([frames, world_digest(seed)])


def case_digest(case: Case) -> str:
    """Of everything a case's clip is made from."""
    return digest([case, HOLD_OUT, references_digest(case.seed, case.references)])


def clip_of(case: Case) -> Clip:
    """The frames as a prior would hand them over."""
    made = world_of(case.seed)
    frames = references_of(case.seed, case.references)
    poses = made.trajectory.world_from_camera if case.geometry == "true" else None
    known = Known(poses, intrinsics=case.geometry != "unknown_focal")
    clip = drawn_clip(made, frames, known, HOLD_OUT)
    return clip.with_features(appearance=appearance(clip.frames, clip.valid))
