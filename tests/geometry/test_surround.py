"""Several cameras on one car: the first leads, the others are where they are mounted."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.geometry.surround import reconstruct_cameras
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from tests.rigs import MOUNTED, drives, rig_clip, true_poses
from tests.streets import true_geometry


class Method:
    """Geometry of one camera as it truly is, and what it was asked for."""

    def __init__(self, factor: float = 1.0) -> None:
        self.asked: list[Clip] = []
        self.factor = factor

    def __call__(self, clip: Clip) -> Geometry:
        self.asked.append(clip)
        mount = MOUNTED[len(self.asked) - 1]
        made = true_geometry(drives()[mount])
        fixed = np.full_like(made.fixed_regions, len(self.asked) - 1)
        return replace(
            made,
            fixed_regions=fixed,
            region_names=("bonnet",) if fixed.any() else (),
            detected=("something",),
            metres_per_unit=self.factor,
        )


def test_mountings_place_the_others_along_the_path_of_the_first() -> None:
    clip, method = rig_clip(), Method()
    found = reconstruct_cameras(clip, method)
    for camera, mount in enumerate(MOUNTED):
        rows = clip.of_camera(camera)
        poses = np.stack([found.cameras[row].world_from_camera for row in rows])
        np.testing.assert_allclose(poses, true_poses(mount), atol=1e-6)
        np.testing.assert_array_equal(found.depth_m[rows], drives()[mount].depth_m)
    first, second = method.asked
    assert first.known.world_from_camera is None
    assert second.known.ground == drives()["front"].ground
    assert len(second) == 6
    np.testing.assert_allclose(second.known.world_from_camera, true_poses("front_left"), atol=1e-6)


def test_what_is_fixed_to_a_camera_stays_with_it() -> None:
    found = reconstruct_cameras(rig_clip(), Method())
    assert found.region_names == ("bonnet",)
    assert (found.fixed_regions[0] == 0).all()
    assert (found.fixed_regions[1] == 1).all()
    assert found.detected == ("something", "camera 1: something")


def test_depth_of_stereo_alone_is_that_of_each_camera() -> None:
    method = Method()

    def with_stereo(clip: Clip) -> Geometry:
        found = method(clip)
        camera = np.float32(len(method.asked))
        ratio, trust = np.full_like(found.depth_m, camera), np.full_like(found.depth_m, 0.1 * camera)
        return replace(found, stereo_ratio=ratio, stereo_confidence=trust)

    clip = rig_clip()
    found = reconstruct_cameras(clip, with_stereo)
    assert found.stereo_ratio is not None
    assert found.stereo_confidence is not None
    for camera in range(len(MOUNTED)):
        rows = clip.of_camera(camera)
        assert (found.stereo_ratio[rows] == camera + 1).all()
        assert (found.stereo_confidence[rows] == np.float32(0.1) * (camera + 1)).all()


def test_known_poses_are_kept_in_metres() -> None:
    clip = rig_clip(poses=True)
    assert clip.known.world_from_camera is not None
    halved = clip.known.world_from_camera.copy()
    halved[:, :3, 3] /= 2
    unscaled = replace(clip, known=replace(clip.known, world_from_camera=halved, metric=False))
    found = reconstruct_cameras(unscaled, Method(factor=2.0))
    poses = np.stack([camera.world_from_camera for camera in found.cameras])
    np.testing.assert_allclose(poses, clip.known.world_from_camera, atol=1e-9)


def test_cameras_that_are_nowhere_are_refused() -> None:
    clip = rig_clip()
    rig = tuple(camera.at(np.eye(4)) for camera in clip.rig)
    with pytest.raises(InputError, match="2 cameras, and neither their poses nor how they are mounted"):
        reconstruct_cameras(replace(clip, rig=rig), Method())


def test_two_of_the_others_at_one_place_are_refused() -> None:
    clip = rig_clip()
    two = (*clip.rig, clip.rig[1])
    with pytest.raises(InputError, match="3 cameras, and neither their poses nor how they are mounted"):
        reconstruct_cameras(replace(clip, rig=two), Method())


def test_a_refusal_names_the_camera() -> None:
    method = Method()

    def picky(clip: Clip) -> Geometry:
        if method.asked:
            raise InputError("too dark")
        return method(clip)

    with pytest.raises(InputError, match="camera 1 of the rig: too dark"):
        reconstruct_cameras(rig_clip(), picky)


def test_drives_from_one_first_frame_share_its_metre() -> None:
    """The second drive is reconstructed in a unit of half a metre: the depth of the common frame tells."""
    front = drives()["front"]
    one = true_geometry(front)

    def method(clip: Clip) -> Geometry:
        factor = 1.0 if int(clip.camera[0]) == 0 else 2.0
        cameras = []
        for camera in one.cameras:
            pose = camera.world_from_camera.copy()
            pose[:3, 3] *= factor
            cameras.append(camera.at(pose))
        return replace(one, cameras=tuple(cameras), depth_m=(factor * one.depth_m).astype(np.float32))

    clip = rig_clip()
    count = len(clip.rig)
    rig = tuple(replace(clip.rig[0]) for _ in range(count))
    shared = replace(clip, rig=rig, known=replace(clip.known, world_from_camera=None, shared_first=True))
    found = reconstruct_cameras(shared, method)
    for camera in range(count):
        rows = shared.of_camera(camera)
        poses = np.stack([found.cameras[row].world_from_camera for row in rows])
        true = np.stack([each.world_from_camera for each in one.cameras])
        np.testing.assert_allclose(poses, true, atol=1e-6)
        np.testing.assert_allclose(found.depth_m[rows], one.depth_m, rtol=1e-5)
