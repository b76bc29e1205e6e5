"""A car with two cameras, one ahead and one to the left, in the built-in street."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.street.truth import DriveTruth, Mount
from streetworld import StreetOptions, World, draw_street, drive, front_from_mount
from tests.streets import street_clip

MOUNTED: tuple[Mount, ...] = ("front", "front_left")


@lru_cache
def drives(frames: int = 6, size: tuple[int, int] = (96, 64)) -> dict[Mount, DriveTruth]:
    """What each camera records; do not change it."""
    layout = draw_street(4, StreetOptions(seconds=frames / 10))
    world = World(layout)
    return {mount: drive(layout, frames, 10.0, size, world=world, mount=mount) for mount in MOUNTED}


def true_poses(mount: Mount) -> np.ndarray:
    """Poses (F, 4, 4) of a camera in the world of the front camera."""
    made = drives()
    world_from_own = made["front"].world_from_map @ np.linalg.inv(made[mount].world_from_map)
    return np.stack([world_from_own @ camera.world_from_camera for camera in made[mount].cameras])


def rig_clip(*, poses: bool = False) -> Clip:
    """The frames of both cameras, in the order of time, with their mountings."""
    layout = next(iter(drives().values())).layout
    parts = [street_clip(made, hold_out=4) for made in drives().values()]
    camera, row = np.tile([0, 1], len(parts[0])), np.repeat(np.arange(len(parts[0])), 2)
    known = Known(intrinsics=True)
    if poses:
        placed = np.stack([true_poses(mount) for mount in MOUNTED])
        known = replace(known, world_from_camera=placed[camera, row])
    fields = ("frames", "times_s", "valid", "held_out", "source_index")
    both = zip(camera, row, strict=True)
    picked = [(int(c), int(r)) for c, r in both]
    return Clip(
        **{name: np.stack([getattr(parts[c], name)[r] for c, r in picked]) for name in fields},
        camera=camera,
        rig=tuple(p.rig[0].at(front_from_mount(layout, m)) for p, m in zip(parts, MOUNTED, strict=True)),
        known=known,
    )
