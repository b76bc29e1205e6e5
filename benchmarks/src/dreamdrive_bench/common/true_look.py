"""What a street network without mistakes would see of a drawn street."""

import numpy as np
from jaxtyping import Int, UInt8

from dreamdrive.scene.street.look import CameraEstimate, Look, RoadUser
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_train.street_network import CLASS_OF

_EMPTY = (StreetClass.SKY, StreetClass.OWN_CAR)
_SPREAD = 0.1
_FOCAL_SPREAD, _HORIZON_SPREAD_PX, _ROLL_SPREAD_RAD = 0.1, 2.0, 0.01


def true_look(made: DriveTruth, focal_px: float | None = None) -> Look:
    """Depth, classes and outlines as they are; the focal length, too, unless another one is told.

    The horizon is said to be in the middle and level, and spreads are those of a network.
    """
    count, height, width = made.instance.shape
    classes = CLASS_OF[made.semantic]
    empty = np.isin(classes, _EMPTY)
    camera_height_m = abs(float(made.ground.height_m(made.cameras[0].world_from_camera[:3, 3])))
    focal_px = made.cameras[0].fx_px if focal_px is None else focal_px
    lens = 0.0, _HORIZON_SPREAD_PX, 0.0, _ROLL_SPREAD_RAD, 0.0
    camera = CameraEstimate(width, height, focal_px, _FOCAL_SPREAD, *lens)
    outlined = [_outlined(*each) for each in zip(made.instance, classes, strict=True)]
    return Look(
        depth=np.where(empty, 0, made.depth_m / camera_height_m).astype(np.float32),
        spread=np.where(empty, 0, _SPREAD).astype(np.float16),
        classes=classes,
        confidence=np.ones(classes.shape, np.float16),
        instances=np.stack([instances for instances, _ in outlined]),
        road_users=tuple(road_users for _, road_users in outlined),
        cameras=(camera,) * count,
        camera=camera,
    )


def _outlined(
    instance: Int[np.ndarray, "h w"], classes: UInt8[np.ndarray, "h w"]
) -> tuple[np.ndarray, tuple[RoadUser, ...]]:
    """Road users of a frame, and 1 + the index of each at its pixels (H, W)."""
    names, instances = np.unique(instance, return_inverse=True)
    instances = instances.reshape(instance.shape) + (names[0] != 0)
    road_users: list[RoadUser] = []
    for number in range(1, int(instances.max()) + 1):
        there = instances == number
        rows, columns = np.nonzero(there)
        box = int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1
        kind = StreetClass(int(np.bincount(classes[there]).argmax()))
        road_users.append(RoadUser(kind, 1.0, box, len(rows)))
    return instances.astype(np.uint16), tuple(road_users)
