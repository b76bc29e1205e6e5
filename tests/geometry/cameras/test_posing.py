from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.geometry import GeometryOptions
from dreamdrive.geometry.cameras.paths import fill, rebase
from dreamdrive.geometry.cameras.posing import Posed, pose_clip
from dreamdrive.geometry.road.known_depth import in_metres
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Scale
from dreamdrive.scene.street.look import CameraEstimate, Look
from tests.geometry.toy_drive import HEIGHT, HEIGHT_M, WIDTH, make_clip, straight, turning


def stack(posed: Posed) -> np.ndarray:
    return np.stack([camera.world_from_camera for camera in posed.cameras])


def tilted(clip: Clip, up_deg: float, roll_deg: float) -> Clip:
    """The clip with a look by which its camera looks up and is rolled clockwise."""
    horizon_px = clip.rig[0].fy_px * np.tan(np.radians(up_deg)) / np.cos(np.radians(roll_deg))
    focal_px = clip.rig[0].fx_px
    camera = CameraEstimate(WIDTH, HEIGHT, focal_px, 0.1, horizon_px, 2.0, np.radians(roll_deg), 0.01, 0.0)
    blank = np.zeros(clip.valid.shape, np.uint8)
    shown = np.ones(clip.valid.shape, np.float32)
    count = len(clip)
    users = blank.astype(np.uint16)
    return replace(
        clip, looks=(Look(shown, shown, blank + 1, shown, users, ((),) * count, (camera,) * count, camera),)
    )


@pytest.fixture(scope="module")
def clip() -> Clip:
    return make_clip(straight([0.5] * 7))


def test_a_standing_clip_gets_one_place_and_a_reason() -> None:
    posed = pose_clip(make_clip(straight([0.0] * 7)))
    assert posed.standing
    assert posed.fallback is not None
    assert "stands still" in posed.fallback
    assert posed.fallback in posed.detected
    np.testing.assert_allclose(stack(posed), np.tile(np.eye(4), (8, 1, 1)), atol=1e-12)
    assert not np.ptp(stack(posed)[:, :3, 3], axis=0).any()


def test_known_poses_are_used_untouched(clip: Clip) -> None:
    path = turning(5, 0.4, 2.0)
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = Rotation.from_euler("xyz", [0.3, -0.5, 1.1]).as_matrix(), [5, -2, 30]
    rendered = make_clip(path)
    posed = pose_clip(replace(rendered, known=Known(world_from_camera=moved @ path, intrinsics=True)))
    np.testing.assert_allclose(stack(posed), path, atol=1e-9)
    assert posed.scale.source == "poses"
    # The road is found at the true height; a car's camera would be at 1.5 m.
    assert posed.scale.others == {"camera height 1.50 m (assumed)": pytest.approx(1.5 / HEIGHT_M, rel=0.03)}
    assert posed.fallback is None
    assert posed.ground is not None
    assert posed.ground.offset_m == pytest.approx(HEIGHT_M, rel=0.03)


def test_metres_and_a_focal_length_that_a_prior_guessed_are_no_given_ones(clip: Clip) -> None:
    path = turning(5, 0.4, 2.0)
    guess = Scale("camera height of 1.2 m", 0.2, basis="seen sizes")
    known = Known(path, intrinsics=True, generated=True, scale=guess, focal_guessed=True)
    posed = pose_clip(replace(make_clip(path), known=known))
    assert posed.scale == replace(guess, others=posed.scale.others)
    assert posed.scale.others
    assert not posed.focal.observed


def test_known_poses_in_an_unknown_unit_are_scaled_by_the_road(clip: Clip) -> None:
    path = turning(5, 0.4, 2.0)
    small = path.copy()
    small[:, :3, 3] /= 7.3
    rendered = make_clip(path)
    depth = np.ones(rendered.valid.shape, np.float32)
    known = Known(world_from_camera=small, intrinsics=True, metric=False, depth_m=depth)
    # The road shows the scale, not the depth, whose points lie on a wall in front of each camera.
    posed = pose_clip(replace(rendered, known=known), GeometryOptions(camera_height_m=HEIGHT_M))
    assert posed.metres_per_unit == pytest.approx(7.3, rel=0.03)
    np.testing.assert_allclose(stack(posed)[:, :3, :3], path[:, :3, :3], atol=1e-9)
    np.testing.assert_allclose(stack(posed)[:, :3, 3], path[:, :3, 3], atol=0.1)
    assert posed.scale.source.startswith("ground plane")
    assert 0 < posed.scale.spread < 0.1
    scaled = in_metres(replace(rendered, known=known), posed.metres_per_unit).known.depth_m
    assert scaled is not None
    assert scaled.max() == pytest.approx(7.3, rel=0.03)


def test_poses_in_an_unknown_unit_are_left_out_where_the_camera_stands() -> None:
    still = make_clip(straight([0.0] * 7))
    noise = np.tile(np.eye(4), (8, 1, 1))
    noise[:, 0, 3] = 0.01 * np.arange(8)
    known = Known(world_from_camera=noise, metric=False, depth_m=np.ones(still.valid.shape, np.float32))
    posed = pose_clip(replace(still, known=known))
    assert posed.standing
    assert posed.fallback is not None
    assert "not used" in posed.fallback
    assert in_metres(replace(still, known=known), posed.metres_per_unit).known.depth_m is None


def test_known_depth_gives_scale_and_ground(clip: Clip) -> None:
    rays = clip.rig[0].rays()
    with np.errstate(divide="ignore"):
        road = np.where(rays[..., 1] > 0.02, HEIGHT_M / rays[..., 1], 0.0)
    depth = np.where(road < 9 / np.maximum(np.abs(rays[..., 0]), 1e-9), road, 0.0)
    known = Known(intrinsics=True, depth_m=np.repeat(depth[None], len(clip), axis=0))
    posed = pose_clip(replace(clip, known=known))
    assert posed.scale.source == "depth"
    assert list(posed.scale.others.values()) == [pytest.approx(1.5 / HEIGHT_M, rel=0.1)]
    assert posed.cameras[-1].world_from_camera[2, 3] == pytest.approx(3.5, rel=0.02)


def test_dark_frames_are_said(clip: Clip) -> None:
    dark = (clip.frames // 40).astype(np.uint8)
    posed = pose_clip(replace(clip, frames=dark))
    assert any("dark" in sentence for sentence in posed.detected)
    black = pose_clip(replace(clip, frames=np.zeros_like(clip.frames)))
    assert black.fallback is not None
    assert "dark or too blank" in black.fallback


@pytest.mark.slow
def test_shuffled_frames_end_in_the_fallback_and_say_why(clip: Clip) -> None:
    order = np.array([3, 0, 6, 1, 7, 2, 5, 4])
    posed = pose_clip(replace(clip, frames=clip.frames[order]))
    assert posed.fallback is not None
    assert "refused" in posed.fallback
    assert posed.fallback in posed.detected
    assert posed.scale.spread > 0.3


@pytest.mark.parametrize("count", [1, 2])
def test_very_short_clips_are_posed(count: int) -> None:
    posed = pose_clip(make_clip(straight([0.5] * (count - 1))))
    assert len(posed.cameras) == count
    np.testing.assert_array_equal(posed.cameras[0].world_from_camera, np.eye(4))
    assert posed.fallback is not None


@pytest.mark.slow
def test_a_bonnet_is_handed_on_with_its_name() -> None:
    posed = pose_clip(make_clip(straight([0.5] * 7), hood=True))
    assert posed.fallback is None
    assert posed.region_names == ("bonnet",)
    assert posed.fixed_regions.shape == (HEIGHT, WIDTH)
    assert any(sentence.startswith("bonnet") for sentence in posed.detected)


@pytest.mark.parametrize("height", [0.0, -1.5, float("nan")])
def test_a_camera_height_must_be_positive(height: float) -> None:
    with pytest.raises(InputError, match="camera-height"):
        GeometryOptions(camera_height_m=height)


@settings(max_examples=30)
@given(st.integers(0, 2**31), st.integers(2, 6))
def test_rebasing_keeps_relative_poses(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Rotation.random(count, random_state=rng).as_matrix()
    poses[:, :3, 3] = rng.normal(size=(count, 3))
    points = rng.normal(size=(4, 3))
    moved, there = rebase(poses, points)
    np.testing.assert_allclose(moved[0], np.eye(4), atol=1e-12)
    np.testing.assert_allclose(
        np.linalg.inv(moved[0]) @ moved[-1], np.linalg.inv(poses[0]) @ poses[-1], atol=1e-9
    )
    np.testing.assert_allclose(
        (there - moved[-1, :3, 3]) @ moved[-1, :3, :3],
        (points - poses[-1, :3, 3]) @ poses[-1, :3, :3],
        atol=1e-9,
    )


def test_missing_poses_are_interpolated_and_carried_on() -> None:
    path = straight([1.0] * 5)
    holes = path.copy()
    holes[[2, 5]] = np.nan
    np.testing.assert_allclose(fill(holes, 0.1 * np.arange(6)), path, atol=1e-9)
    with pytest.raises(ValueError, match="interpolate"):
        fill(np.full((3, 4, 4), np.nan), np.arange(3.0))


def test_given_poses_that_stand_leave_depth_a_guess() -> None:
    still = make_clip(straight([0.0] * 7))
    known = Known(world_from_camera=np.tile(np.eye(4), (8, 1, 1)), intrinsics=True)
    posed = pose_clip(replace(still, known=known))
    assert (posed.standing, posed.fallback, posed.fallback_kind) == (True, None, "standing")
    depth = np.ones(still.valid.shape, np.float32)
    assert pose_clip(replace(still, known=replace(known, depth_m=depth))).fallback_kind is None


def test_the_kind_of_a_fallback_and_of_the_metre_are_told(clip: Clip) -> None:
    still = pose_clip(make_clip(straight([0.0] * 7)), GeometryOptions(camera_height_m=1.4))
    assert (still.fallback_kind, still.scale.basis) == ("standing", "height")
    black = pose_clip(replace(clip, frames=np.zeros_like(clip.frames)))
    assert (black.fallback_kind, black.scale.basis) == ("blank", "usual height")
    assert pose_clip(make_clip(straight([0.5]))).fallback_kind == "few"
    assert pose_clip(make_clip(straight([]))).fallback_kind is not None


@pytest.mark.parametrize("steps", [[], [0.0] * 7], ids=["single", "standing"])
def test_without_motion_the_road_lies_below_the_horizon_that_is_seen(steps: list[float]) -> None:
    clip = make_clip(straight(steps))
    posed = pose_clip(tilted(clip, 3, -2), GeometryOptions(camera_height_m=1.2))
    assert posed.fallback is not None
    assert posed.ground is not None
    level_from_camera = Rotation.from_euler("zx", [-2, 3], degrees=True)
    np.testing.assert_allclose(
        posed.ground.normal_world, level_from_camera.inv().apply([0, -1, 0]), atol=1e-9
    )
    assert posed.ground.offset_m == 1.2
    assert "looks up by 3.0 degrees and leans to the left by 2.0" in " ".join(posed.detected)
    assert any(sentence.startswith("depth is what the street network sees") for sentence in posed.detected)
    assert posed.scale.source.startswith("level road below the horizon")
    level = pose_clip(clip)
    assert level.ground is not None
    np.testing.assert_array_equal(level.ground.normal_world, [0, -1, 0])
    assert level.scale.source == "level road assumed, camera height 1.50 m (assumed)"
    assert not any("street network" in sentence for sentence in level.detected)


def test_given_poses_that_stand_get_the_road_below_the_horizon_that_is_seen() -> None:
    still = make_clip(straight([0.0] * 7))
    known = Known(world_from_camera=np.tile(np.eye(4), (8, 1, 1)), intrinsics=True)
    posed = pose_clip(tilted(replace(still, known=known), 3, 0))
    assert posed.ground is not None
    assert posed.ground.normal_world[2] == pytest.approx(np.sin(np.radians(3)))
    assert posed.scale.source == "poses"
    assert pose_clip(replace(still, known=known)).ground is None
