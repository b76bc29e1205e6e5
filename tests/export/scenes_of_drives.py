"""Scenes that were made of a drive, and know their road."""

from dataclasses import replace

import numpy as np

from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.log import Log
from tests.tasks.perception.test_samples import scene_of


def upright_scene_of(drive: Log) -> Scene:
    """One of the road alone, whose first view is the second picture of the drive."""
    scene = scene_of(drive)
    up = np.linalg.inv(drive.cameras[0].world_from_camera[1])[:3, 2]
    about = replace(scene.provenance, up=(float(up[0]), float(up[1]), float(up[2])), camera_height_m=1.4)
    return replace(scene, provenance=about)
