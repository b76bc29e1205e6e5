"""Errors of single poses go, and turns that frames show stay."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from dreamdrive.geometry import calmed
from dreamdrive.geometry.dense import densify
from dreamdrive.scene.geometry import Geometry
from tests.geometry import toy


def off(geometry: Geometry, truth: Geometry) -> tuple[float, float]:
    """Deviation of the steps in metres and of the turns in degrees from frame to frame."""
    poses, true = (np.stack([c.world_from_camera for c in each.cameras]) for each in (geometry, truth))
    apart = poses[:, :3, 3] - true[:, :3, 3]
    turns = Rotation.from_matrix(true[:, :3, :3]).inv() * Rotation.from_matrix(poses[:, :3, :3])
    steps_m, turns_deg = np.diff(apart, axis=0), np.diff(np.degrees(turns.as_rotvec()), axis=0)
    return float(np.sqrt((steps_m**2).mean())), float(np.sqrt((turns_deg**2).mean()))


def test_a_path_that_jitters_becomes_smooth_and_keeps_its_way() -> None:
    street, rng = toy.drive([], count=9), np.random.default_rng(0)
    truth = densify(street.clip, street.posed)
    shaken = []
    for camera in truth.cameras:
        pose = camera.world_from_camera.copy()
        pose[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(np.radians(rng.normal(0, 0.5, 3))).as_matrix()
        pose[:3, 3] += rng.normal(0, 0.1, 3)
        shaken.append(camera.at(pose))
    rough = replace(truth, cameras=tuple(shaken))
    found = calmed(street.clip, rough)
    assert np.allclose(found.cameras[0].world_from_camera, np.eye(4), atol=1e-6)
    for before, after in zip(off(rough, truth), off(found, truth), strict=True):
        assert after < 0.3 * before
    np.testing.assert_array_equal(found.depth_m, rough.depth_m)
