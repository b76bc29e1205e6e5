"""From measured cameras and depth to metres: standing and crawling clips, units that are not known."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.geometry import GeometryOptions
from dreamdrive.geometry.cameras.paths import stands
from dreamdrive.geometry.evidence import observe
from dreamdrive.geometry.finish import check_frames, finish
from dreamdrive.geometry.measured import Measured
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Geometry, Ground
from tests.geometry.toy import HEIGHT_M, Toy, drive
from tests.geometry.toy_drive import make_clip, straight

UNIT = 0.07  # metres in a unit of the network


@pytest.fixture(scope="module")
def still() -> Toy:
    toy = drive([], step_m=0.0)
    return replace(toy, clip=replace(toy.clip, known=Known(intrinsics=True)))


@pytest.fixture(scope="module")
def moving() -> Toy:
    toy = drive([])
    return replace(toy, clip=replace(toy.clip, known=Known(intrinsics=True)))


def jittered(count: int, metres: float) -> np.ndarray:
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, 3] = metres * np.random.default_rng(0).standard_normal((count, 3))
    return poses


def measured(toy: Toy, poses: np.ndarray, **more: object) -> Measured:
    """Poses in metres and the true depth, in the network's unit."""
    poses = poses.copy()
    poses[:, :3, 3] /= UNIT
    depth = (toy.depth_m / UNIT).astype(np.float32)
    return Measured(poses, toy.clip.rig[0], True, depth, (depth > 0).astype(np.float32), **more)  # type: ignore[arg-type]


def finished(clip: Clip, found: Measured, height_m: float | None = None) -> Geometry:
    return finish(clip, found, observe(clip), GeometryOptions(camera_height_m=height_m))


def depth_ratio(found: Geometry, toy: Toy) -> float:
    both = (found.depth_m > 0) & (toy.depth_m > 0) & (toy.depth_m < 40)
    assert both.mean() > 0.3
    return float(np.median(found.depth_m[both] / toy.depth_m[both]))


@pytest.mark.parametrize("jitter_m", [0.0, 0.01])
def test_a_standing_clip_has_one_pose_and_its_scale_from_the_road_in_the_depth(
    still: Toy, jitter_m: float
) -> None:
    count = len(still.clip)
    found = finished(
        still.clip,
        measured(still, jittered(count, jitter_m)),
        HEIGHT_M,
    )
    poses = np.stack([camera.world_from_camera for camera in found.cameras])
    np.testing.assert_array_equal(poses, np.tile(np.eye(4), (count, 1, 1)))
    assert depth_ratio(found, still) == pytest.approx(1, abs=0.03)
    assert "ground plane" in found.scale.source
    assert found.scale.spread < 0.1
    assert found.ground is not None
    assert any("stands still" in note for note in found.detected)


def test_without_a_road_a_standing_clip_says_what_it_assumes(still: Toy) -> None:
    found = measured(still, jittered(len(still.clip), 0.01))
    below = np.arange(still.depth_m.shape[1])[:, None] > 60
    seen = finished(still.clip, replace(found, depth=np.where(below, 0, found.depth)))
    assert "median depth of 12 m is assumed" in seen.scale.source
    assert seen.scale.spread > 0.5
    assert np.median(seen.depth_m[seen.depth_m > 0]) == pytest.approx(12, rel=0.1)


@pytest.mark.parametrize("metres", [0.0, 0.01])
def test_frames_that_move_but_poses_that_hardly_do_keep_the_scale_of_the_road(
    moving: Toy, metres: float
) -> None:
    found = finished(
        moving.clip,
        measured(moving, jittered(len(moving.clip), metres)),
        HEIGHT_M,
    )
    assert found.details["metres_per_unit"] == pytest.approx(UNIT, rel=0.05)
    assert "ground plane" in found.scale.source
    path = np.stack([camera.world_from_camera[:3, 3] for camera in found.cameras])
    assert np.abs(path).max() < 0.1


def test_a_metric_network_keeps_its_metre_where_the_camera_stands(still: Toy) -> None:
    poses = jittered(len(still.clip), 0.01 * UNIT)
    found = finished(still.clip, measured(still, poses, unit="a metric network", unit_spread=0.15))
    assert found.scale.source == "a metric network"
    assert found.scale.spread == 0.15
    assert depth_ratio(found, still) == pytest.approx(1 / UNIT, rel=1e-3)


def test_poses_in_metres_that_stand_are_kept(still: Toy) -> None:
    given = jittered(len(still.clip), 0.02)
    given[:, :3, 3] -= given[0, :3, 3]
    clip = replace(still.clip, known=Known(given, intrinsics=True))
    found = finished(clip, measured(still, jittered(len(clip), 0.01)), HEIGHT_M)
    path = np.stack([camera.world_from_camera for camera in found.cameras])
    np.testing.assert_allclose(path, given, atol=1e-12)
    assert depth_ratio(found, still) == pytest.approx(1, abs=0.03)


def test_a_known_road_says_how_high_the_camera_is(still: Toy) -> None:
    road = Ground(np.array([0.0, -1.0, 0.0]), HEIGHT_M)
    given = np.tile(np.eye(4), (len(still.clip), 1, 1))
    clip = replace(still.clip, known=Known(given, intrinsics=True, ground=road))
    found = finished(clip, measured(still, given), 3.0)
    assert found.ground is not None
    np.testing.assert_array_equal(found.ground.normal_world, road.normal_world)
    assert found.ground.offset_m == HEIGHT_M
    assert depth_ratio(found, still) == pytest.approx(1, abs=0.03)


def test_known_depth_of_an_unknown_unit_is_scaled_with_the_poses(moving: Toy) -> None:
    poses = np.stack([camera.world_from_camera for camera in moving.posed.cameras])
    own = measured(moving, poses)
    known = Known(own.world_from_camera, True, own.depth, metric=False)
    clip = replace(moving.clip, known=known)
    found = finished(clip, own, HEIGHT_M)
    assert depth_ratio(found, moving) == pytest.approx(1, abs=0.05)


def test_known_depth_of_an_unknown_unit_is_left_out_where_the_camera_stands(still: Toy) -> None:
    given = jittered(len(still.clip), 0.01)
    wrong = np.full_like(still.depth_m, 1000.0, dtype=np.float32)
    clip = replace(still.clip, known=Known(given, True, wrong, metric=False))
    found = finished(clip, measured(still, given), HEIGHT_M)
    assert depth_ratio(found, still) == pytest.approx(1, abs=0.03)
    assert any("unknown unit, are not used" in note for note in found.detected)


def test_known_depth_in_metres_gives_the_scale(moving: Toy) -> None:
    poses = np.stack([camera.world_from_camera for camera in moving.posed.cameras])
    known = Known(intrinsics=True, depth_m=(2 * moving.depth_m).astype(np.float32))
    found = finished(replace(moving.clip, known=known), measured(moving, poses))
    assert found.scale.source == "depth"
    assert found.cameras[-1].world_from_camera[2, 3] == pytest.approx(2 * poses[-1, 2, 3], rel=1e-3)
    assert depth_ratio(found, moving) == pytest.approx(2, rel=1e-3)


def test_what_else_tells_metres_is_told(moving: Toy) -> None:
    poses = np.stack([camera.world_from_camera for camera in moving.posed.cameras])
    found = finished(moving.clip, measured(moving, poses, others={"a network": 1.2 * UNIT}))
    assert found.scale.others["a network"] == pytest.approx(1.2 * UNIT / found.details["metres_per_unit"])
    assert found.scale.disagreement is not None
    assert found.scale.disagreement > 0.15


def test_who_stands(still: Toy, moving: Toy) -> None:
    here, there = observe(still.clip), observe(moving.clip)
    assert stands(still.clip, here)
    assert not stands(moving.clip, there)
    count = len(still.clip)
    driven = np.stack([camera.world_from_camera for camera in moving.posed.cameras])
    assert not stands(replace(still.clip, known=Known(driven)), here)
    assert stands(replace(still.clip, known=Known(driven, metric=False)), here)
    assert stands(replace(moving.clip, known=Known(jittered(count, 0.0))), there)
    assert not stands(replace(moving.clip, known=Known(jittered(count, 0.05))), there)


def test_a_drive_is_accepted_and_a_still_is_not() -> None:
    clip = make_clip(straight([0.5, 0.5]))
    check_frames(clip, "dust3r")
    with pytest.raises(InputError, match="dust3r: all 3 frames are alike"):
        check_frames(replace(clip, frames=np.repeat(clip.frames[:1], 3, axis=0)), "dust3r")
