"""How far off the road of a photo is, and its metres."""

import numpy as np

from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_bench.photo.ways import Start
from dreamdrive_train.street_network import CLASS_OF

NEAR_M = 20.0


def shape_of(start: Start, made: DriveTruth) -> dict[str, float]:
    """The road's error along its normal within 20 m, given the camera's height; and metres without it."""
    camera, depth = made.cameras[0], made.depth_m[0]
    road = np.isin(CLASS_OF[made.semantic[0]], (StreetClass.ROAD, StreetClass.MARKING))
    near = road & (depth > 0) & (depth < NEAR_M)
    points = (camera.rays() * depth[..., None])[near]
    off = start.street.ground.height_m(points)
    return {"road_rms_m": float(np.sqrt(np.mean(np.square(off)))), "scale": start.told_m / start.height_m}
