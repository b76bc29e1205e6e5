from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dreamdrive.geometry import GeometryOptions
from dreamdrive.geometry.cameras.posing import pose_clip
from dreamdrive.geometry.evidence import observe
from dreamdrive.geometry.road import depth_points, scale
from dreamdrive.geometry.road.ground_points import Plane, fit_points
from dreamdrive.geometry.road.ground_sweep import RoadSweep, sweep
from dreamdrive.geometry.road.scale import (
    PosedClip,
    as_given,
    asked_m_s,
    contradicted,
    from_ground,
    from_road_points,
)
from dreamdrive.scene.trajectory import Trajectory
from tests.geometry.toy_drive import HEIGHT_M, make_clip, straight, turning


@pytest.mark.parametrize("path", [straight([0.6] * 3), turning(5, 0.6, 3.0)], ids=["straight", "turning"])
def test_the_sweep_finds_the_height_of_a_rendered_road(path: np.ndarray) -> None:
    clip = make_clip(path)
    seen = observe(clip)
    plane = sweep(RoadSweep(seen.grey, seen.street, seen.small, path))
    assert plane is not None
    assert plane.height == pytest.approx(HEIGHT_M, rel=0.02)
    assert plane.normal @ [0, -1, 0] > np.cos(np.radians(1.0))


def test_points_give_the_height_although_most_lie_elsewhere() -> None:
    rng = np.random.default_rng(0)
    path = straight([0.6] * 10)
    road = np.stack([rng.uniform(-4, 4, 200), rng.normal(1.5, 0.01, 200), rng.uniform(3, 15, 200)], axis=1)
    walls = np.stack([rng.choice([-6, 6], 400), rng.uniform(-4, 1.4, 400), rng.uniform(3, 25, 400)], axis=1)
    plane = fit_points(np.concatenate([road, walls.astype(float)]), path, 0)
    assert plane is not None
    assert plane.height == pytest.approx(1.5, rel=0.01)
    assert plane.support > 150


def test_a_shelf_above_the_road_is_not_the_road() -> None:
    rng = np.random.default_rng(0)
    path = straight([0.6] * 10)
    shelf = np.stack([rng.uniform(2, 4, 300), rng.normal(0.7, 0.01, 300), rng.uniform(3, 15, 300)], axis=1)
    road = np.stack([rng.uniform(-4, 4, 200), rng.normal(1.5, 0.01, 200), rng.uniform(3, 15, 200)], axis=1)
    plane = fit_points(np.concatenate([shelf, road]), path, 0)
    assert plane is not None
    assert plane.height == pytest.approx(1.5, rel=0.02)


def test_a_blank_road_gives_an_assumed_speed_and_says_so() -> None:
    clip = make_clip(straight([0.6] * 5))
    seen = observe(clip)
    grey = seen.grey.copy()
    grey[:, 90:] = 100
    street = PosedClip(grey, seen.street, seen.small, straight([0.3] * 5), np.zeros((0, 3)), clip.times_s)
    metric = from_ground(street, None, 0.0, 0)
    assert metric.ground is None
    assert metric.scale.source.startswith("none:")
    assert metric.scale.spread >= 0.5
    assert metric.factor * 0.3 / 0.1 == pytest.approx(8.0)
    assert metric.notes
    asked = from_ground(replace(street, asked_m_s=5.0), None, 0.0, 0)
    assert asked.factor * 0.3 / 0.1 == pytest.approx(5.0)
    assert "a speed of 5 m/s is taken as asked for" in asked.scale.source
    assert asked.scale.spread == metric.scale.spread


def test_a_scale_by_the_road_is_as_uncertain_as_the_focal_length() -> None:
    clip, rng = make_clip(straight([0.6] * 5)), np.random.default_rng(0)
    road = np.stack([rng.uniform(-4, 4, 300), rng.normal(1.5, 0.01, 300), rng.uniform(3, 15, 300)], axis=1)
    grey, camera = np.zeros((6, 40, 64), np.uint8), clip.rig[0]
    street = PosedClip(grey, grey == 0, camera, straight([0.6] * 5), road, clip.times_s)
    found = [from_road_points(street, 1.5, spread, 0) for spread in (0.0, 0.05, 0.35)]
    exact, network, assumed = (each.scale.spread for each in found if each is not None)
    assert exact < 0.1
    assert network == pytest.approx(np.hypot(exact, 0.05))
    assert assumed == pytest.approx(np.hypot(exact, 0.35))


def test_the_speed_that_was_asked_for_is_that_of_the_moving_part() -> None:
    clip = make_clip(straight([0.6] * 5))
    assert asked_m_s(clip) is None
    path = Trajectory(straight([0.0, 0.5, 0.5, 0.5, 0.5]), clip.times_s)
    assert asked_m_s(replace(clip, requested=path)) == pytest.approx(5.0)
    stands = Trajectory(straight([0.0] * 5), clip.times_s)
    assert asked_m_s(replace(clip, requested=stands)) is None


def test_the_camera_height_gives_metres() -> None:
    posed = pose_clip(make_clip(straight([0.5] * 7)), GeometryOptions(camera_height_m=HEIGHT_M))
    assert posed.cameras[-1].world_from_camera[2, 3] == pytest.approx(3.5, rel=0.03)
    assert posed.ground is not None
    assert posed.ground.offset_m == pytest.approx(HEIGHT_M, rel=0.03)
    assert "1.50 m (given)" in posed.scale.source
    assert posed.scale.spread < 0.1


@cache
def driven() -> PosedClip:
    """A street whose road shows, by poses in metres."""
    path = straight([0.6] * 3)
    clip = make_clip(path)
    return PosedClip.of(clip, observe(clip), clip.rig[0], path, np.zeros((0, 3)))


@pytest.mark.parametrize(
    ("unit", "told_m", "said"),
    [
        (0.1, None, "where cars carry it 1 to 3.5 m high"),
        (0.5, None, "where cars carry it 1 to 3.5 m high"),
        (1.0, None, ""),
        (2.0, None, ""),
        (5.0, None, "where cars carry it 1 to 3.5 m high"),
        (0.1, HEIGHT_M, "not 1.50 m"),
        (0.5, HEIGHT_M, "not 1.50 m"),
        (1.0, HEIGHT_M, ""),
        (2.0, HEIGHT_M, "not 1.50 m"),
        (5.0, HEIGHT_M, "not 1.50 m"),
    ],
)
def test_a_unit_that_is_no_metre_is_said(unit: float, told_m: float | None, said: str) -> None:
    seen = driven()
    poses = seen.world_from_camera.copy()
    poses[:, :3, 3] *= unit
    street = replace(seen, world_from_camera=poses)
    against = as_given(street, "poses", 0.0, "the given poses", told_m, 0).scale.against
    assert bool(against) == bool(said)
    assert against.endswith(said)
    if said:
        assert float(against.split()[3]) == pytest.approx(unit * HEIGHT_M, rel=0.05)


def test_a_speed_that_no_car_drives_is_said() -> None:
    assert contradicted(None, None, 80.0) == "the car drives 80 m/s"
    assert contradicted(1.6, None, 30.0) == contradicted(None, 1.5) == ""


@pytest.mark.parametrize(("step_m", "said"), [(0.0, False), (0.6, True)])
def test_a_standing_camera_shows_no_unit_that_is_wrong(
    monkeypatch: pytest.MonkeyPatch, step_m: float, said: bool
) -> None:
    """Poses of a car that waits jitter, and a plane of any height fits them."""

    def found(street: PosedClip, seed: int, heights: object = None) -> tuple[Plane | None, str]:
        level = Plane(np.array([0.0, -1.0, 0.0]), 0.004, 0.004, 200.0, 0.5, 0.01)
        return (None if heights else level), "road texture"

    monkeypatch.setattr(scale, "find_ground", found)
    path = straight([step_m] * 5)
    clip = make_clip(path)
    clip = replace(clip, known=replace(clip.known, world_from_camera=path, metric=True))
    assert ("0.00 m above the road" in pose_clip(clip).scale.against) == said


def test_single_points_of_lidar_are_all_looked_at() -> None:
    clip = make_clip(straight([0.6] * 2))
    depth = np.zeros(clip.frames.shape[:3], np.float32)
    depth[:, 1::7, 1::7] = 9.0
    clip = replace(clip, known=replace(clip.known, depth_m=depth))
    points = depth_points(clip)
    assert len(points) >= 0.5 * min(400 * len(clip), int((depth > 0).sum()))
    assert (points[:, 2] >= 9).all()
