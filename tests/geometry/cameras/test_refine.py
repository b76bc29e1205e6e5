from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.geometry.cameras.refine import refined
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Focal, Geometry, Ground, Scale
from tests.geometry.toy_drive import HEIGHT_M, make_clip, turning

PATH = turning(8, 0.4, 2.0)
UNIT = 0.8  # of what the frames alone show


@pytest.fixture(scope="module")
def clip() -> Clip:
    return replace(make_clip(PATH), known=Known(world_from_camera=rough(PATH), intrinsics=True))


def rough(path: np.ndarray) -> np.ndarray:
    """The path as a positioning system has it: in a world of its own, 2 cm off."""
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], (100.0, -40.0, 7.0)
    poses = world @ path
    poses[:, :3, 3] += np.random.default_rng(0).normal(0, 0.02, (len(path), 3))
    return poses


def seen(clip: Clip) -> Geometry:
    """What a way of getting geometry finds in the frames: the true path, too short."""
    poses = PATH.copy() if clip.known.world_from_camera is None else clip.known.world_from_camera.copy()
    if clip.known.world_from_camera is None:
        poses[:, :3, 3] *= UNIT
    shape = clip.frames.shape[:3]
    return Geometry(
        cameras=tuple(clip.rig[0].at(pose) for pose in poses),
        depth_m=np.full(shape, 10.0 * UNIT, np.float32),
        confidence=np.ones(shape, np.float32),
        sky=np.zeros(shape, bool),
        moving=np.zeros(shape, np.float32),
        fixed_regions=np.zeros((1, *shape[1:]), np.int64),
        region_names=(),
        ground=Ground(np.array([0.0, -1.0, 0.0]), HEIGHT_M * UNIT),
        scale=Scale("camera height", 0.2, {"traffic": 1.1}),
        focal=Focal(clip.rig[0].fx_px, True),
    )


def test_the_frames_give_the_path_and_the_poses_its_length(clip: Clip) -> None:
    found = refined(clip, seen)
    poses = np.stack([camera.world_from_camera for camera in found.cameras])
    np.testing.assert_allclose(poses, PATH, atol=0.03)
    turns = poses[:, :3, :3]
    np.testing.assert_array_equal(turns, PATH[:, :3, :3])
    assert found.depth_m[0, 0, 0] == pytest.approx(10, rel=0.01)
    assert found.ground is not None
    assert found.ground.offset_m == pytest.approx(HEIGHT_M, rel=0.01)
    assert found.scale.source == "length of the given path"
    assert found.scale.others["camera height"] == pytest.approx(UNIT, rel=0.01)
    assert found.scale.others["traffic"] == pytest.approx(1.1 * UNIT, rel=0.01)
    assert any("refined by the frames: moved by 0.0" in note for note in found.detected)


def test_a_reconstruction_that_failed_keeps_the_poses(clip: Clip) -> None:
    found = refined(clip, lambda one: replace(seen(one), fallback="too dark"))
    np.testing.assert_array_equal(found.cameras[3].world_from_camera, rough(PATH)[3])
    assert "not refined: too dark" in found.detected[-1]


def test_poses_that_stand_are_kept(clip: Clip) -> None:
    still = np.tile(np.eye(4), (len(PATH), 1, 1))
    found = refined(replace(clip, known=Known(world_from_camera=still)), seen)
    assert "the camera stands still" in found.detected[-1]


@pytest.mark.parametrize(
    ("known", "message"),
    [
        (Known(), "there are none"),
        (Known(world_from_camera=PATH, metric=False), "unit is not known"),
        (Known(world_from_camera=turning(8, 0.4, -30.0)), "apart"),
    ],
)
def test_what_cannot_be_refined_is_said(clip: Clip, known: Known, message: str) -> None:
    with pytest.raises(InputError, match=message):
        refined(replace(clip, known=known), seen)
