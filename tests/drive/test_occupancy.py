from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.drive import CELL_M, OccupancyOptions, obstacles_of
from dreamdrive.errors import InputError
from dreamdrive.scene.actor import Actor, Track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.level import level_from_world
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.tasks.plan import CAMERA_AHEAD_M, instant_of
from tests.scene.scenes import gaussians, per_frame_scene

HEIGHT_M = 1.5


def dots(points: np.ndarray, opacity: float = 0.9, size_m: float = 0.03) -> Gaussians:
    """Round Gaussians at points of the world: x right, y down, z ahead."""
    made = gaussians(len(points), 1)
    return replace(
        made,
        means=torch.tensor(points, dtype=torch.float32).reshape(-1, 3),
        log_scales=torch.full((len(points), 3), float(np.log(size_m))),
        logit_opacities=torch.full((len(points),), float(np.log(opacity / (1 - opacity)))),
    )


def block(x_m: tuple[float, float], z_m: tuple[float, float], up_m: tuple[float, float]) -> np.ndarray:
    """Points all over a block, given by its height above the road."""
    spans = [np.arange(*ends, 0.1) for ends in (x_m, z_m, up_m)]
    x, z, up = np.stack(np.meshgrid(*spans), axis=-1).reshape(-1, 3).T
    return np.column_stack([x, HEIGHT_M - up, z])


def scene_of(static: Gaussians, dynamic: Gaussians | None = None, speed_m_s: float = 10.0) -> Scene:
    """Eleven frames in a second of a camera that drives ahead."""
    times_s = np.linspace(0, 1, 11)
    poses = np.tile(np.eye(4), (11, 1, 1))
    poses[:, 2, 3] = speed_m_s * times_s
    return Scene(
        static=static,
        dynamic=dots(np.zeros((0, 3))) if dynamic is None else dynamic,
        deformation=None,
        actors=(),
        sky=None,
        exposure=None,
        cameras=tuple(Camera(50.0, 50.0, 16.0, 12.0, 32, 24).at(pose) for pose in poses),
        times_s=times_s,
        held_out=np.zeros(11, bool),
        provenance=Provenance(up=(0.0, -1.0, 0.0), camera_height_m=HEIGHT_M),
    )


def test_the_level_frame_has_x_ahead_y_left_and_the_road_at_0() -> None:
    level = level_from_world(scene_of(dots(block((0, 1), (5, 6), (0.5, 1)))))
    right_below_ahead = np.array([2.0, HEIGHT_M, 7.0, 1.0])
    np.testing.assert_allclose(level @ right_below_ahead, [7.0, -2.0, 0.0, 1.0], atol=1e-12)


def test_what_is_as_high_as_a_car_takes_the_cells_it_fills() -> None:
    scene = scene_of(dots(block((0.05, 1.0), (10.05, 11.0), (0.5, 1.5))))
    found = obstacles_of(scene, [0.0]).standing_m
    assert sorted(map(tuple, found.tolist())) == [(x, y) for x in (10.25, 10.75) for y in (-0.75, -0.25)]
    assert CELL_M == 0.5


@pytest.mark.parametrize(
    "points", [block((0, 1), (10, 11), (0, 0.2)), block((0, 1), (10, 11), (2.2, 4))], ids=["road", "bridge"]
)
def test_the_road_and_what_is_above_cars_take_nothing(points: np.ndarray) -> None:
    assert not len(obstacles_of(scene_of(dots(points)), [0.0]).standing_m)


def test_fog_sky_and_single_specks_take_nothing() -> None:
    points = block((0, 1), (10, 11), (0.5, 1.5))
    assert not len(obstacles_of(scene_of(dots(points, opacity=0.3)), [0.0]).standing_m)
    assert not len(obstacles_of(scene_of(dots(points, size_m=3.0)), [0.0]).standing_m)
    speck = dots(np.tile([[0.2, 0.5, 20.2]], (10, 1)))
    assert not len(obstacles_of(scene_of(speck), [0.0]).standing_m)
    assert len(obstacles_of(scene_of(dots(points)), [0.0], OccupancyOptions(opacity=1e4)).standing_m) == 0


@pytest.mark.parametrize(("least", "taken"), [(3, 3), (4, 0)])
def test_few_cells_together_are_floaters(least: int, taken: int) -> None:
    # Three cells in a row, by their corners.
    places = np.concatenate([block((0.1 + k, 0.4 + k), (8.1 + k, 8.4 + k), (0.5, 1.5)) for k in (0, 0.5, 1)])
    found = obstacles_of(scene_of(dots(places)), [0.0], OccupancyOptions(least_cells=least))
    assert len(found.standing_m) == taken


def test_what_moves_is_there_at_its_times() -> None:
    living = replace(
        dots(block((0, 1), (10, 11), (0.5, 1.5))), lifespan=torch.tensor([[0.5, 0.1]]).repeat(1000, 1)
    )
    found = obstacles_of(scene_of(dots(np.zeros((0, 3))), living), [0.5, 3.0])
    assert len(found.at(0)) >= 4
    assert not len(found.at(1))


def test_scenes_without_a_road_are_refused() -> None:
    scene = scene_of(dots(block((0, 1), (5, 6), (0.5, 1))))
    with pytest.raises(InputError, match="does not know its road"):
        obstacles_of(replace(scene, provenance=Provenance()), [0.0])
    with pytest.raises(InputError, match="single frames"):
        obstacles_of(per_frame_scene(), [0.0])


def test_a_planner_sees_them_from_where_the_car_is() -> None:
    scene = scene_of(dots(block((2.05, 3.0), (30.05, 31.0), (0.5, 1.5))))
    found = instant_of(scene, 1.0, np.array([0.5, 1.0]))
    assert found.speed_m_s == pytest.approx(10.0)
    assert found.yaw_rate_rad_s == pytest.approx(0.0)
    np.testing.assert_allclose(found.level_from_planning, [10 - CAMERA_AHEAD_M, 0, 0], atol=1e-9)
    for cells in found.obstacles_m:
        assert sorted(map(tuple, (cells - [0, CAMERA_AHEAD_M]).round(6).tolist())) == [
            (x, y) for x in (2.25, 2.75) for y in (20.25, 20.75)
        ]


def test_the_car_itself_is_no_obstacle() -> None:
    bonnet = dots(block((-0.5, 0.5), (10.5, 11.2), (0.5, 1.0)))
    assert not len(instant_of(scene_of(bonnet), 1.0, np.array([0.5])).obstacles_m[0])


def test_a_turned_car_has_what_is_ahead_of_it_ahead() -> None:
    scene = scene_of(dots(block((4.05, 5.0), (4.05, 5.0), (0.5, 1.5))), speed_m_s=0.0)
    turned = np.eye(4)
    turned[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]  # looks to the right
    cameras = (*scene.cameras[:-1], scene.cameras[0].at(turned))
    found = instant_of(replace(scene, cameras=cameras), 1.0, np.array([0.5]))
    assert found.level_from_planning[2] == pytest.approx(-np.pi / 2)
    middle = found.obstacles_m[0].mean(axis=0)
    np.testing.assert_allclose(middle, [-4.5, 4.5 + CAMERA_AHEAD_M], atol=1e-6)


@pytest.mark.parametrize("now_s", [-0.1, 1.1, 0.0])
def test_moments_that_tell_no_speed_are_refused(now_s: float) -> None:
    scene = scene_of(dots(block((0, 1), (5, 6), (0.5, 1))))
    with pytest.raises(InputError, match=r"lies outside|tells no speed"):
        instant_of(scene, now_s, np.array([0.5]))


def test_what_moves_goes_on_as_it_did_whatever_lives_later() -> None:
    points = block((2.05, 3.0), (30.05, 31.0), (0.5, 1.5))
    living = replace(
        dots(points),
        lifespan=torch.tensor([[1.0, 0.05]]).repeat(len(points), 1),
        actor=torch.zeros(len(points), dtype=torch.int64),
    )
    times_s = np.linspace(0, 1, 11)
    places = np.column_stack([np.full(11, 2.5), np.full(11, HEIGHT_M), 26.5 + 4.0 * times_s])
    actor = Actor(0, "actor 0", "vehicle", len(points), Track(times_s, places, np.zeros(11)))
    scene = replace(scene_of(dots(np.zeros((0, 3))), living), actors=(actor,))
    found = instant_of(scene, 1.0, np.array([0.5, 2.0]))
    for cells, gone_m in zip(found.obstacles_m, (2.0, 8.0), strict=True):
        middle = cells.mean(axis=0) - [0, CAMERA_AHEAD_M]
        np.testing.assert_allclose(middle, [2.5, 20.5 + gone_m], atol=1e-6)
    assert not len(obstacles_of(scene, [1.0, 3.0]).at(1))


def test_what_turns_goes_on_turning() -> None:
    points = block((-0.2, 0.25), (10, 14), (0.5, 1.5))
    living = replace(dots(points), actor=torch.zeros(len(points), dtype=torch.int64))
    times_s = np.linspace(0, 1, 11)
    places = np.tile([0.0, HEIGHT_M, 12.0], (11, 1))
    track = Track(times_s, places, np.pi / 4 * times_s)
    scene = replace(
        scene_of(dots(np.zeros((0, 3))), living, 0.0), actors=(Actor(0, "a", "vehicle", 1, track),)
    )
    found = instant_of(scene, 1.0, np.array([0.1, 2.0]))
    along, across = (np.ptp(cells, axis=0) for cells in found.obstacles_m)
    assert along[1] > 3 > along[0]
    assert across[0] > 3 > across[1]
