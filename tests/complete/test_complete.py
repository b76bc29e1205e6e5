"""A street between two walls, of which pictures show what lies ahead: views aside see no end of it."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.complete import CompletionOptions, completed
from dreamdrive.complete.borders import beyond_borders
from dreamdrive.complete.holes import without_holes
from dreamdrive.complete.vehicles import with_vehicles_closed
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Focal, Geometry, Ground, Scale
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.splat import render_scene

WALL_M, HEIGHT_M, SPACING_M = 9.0, 1.5, 0.2
SIZE = (80, 48)


def balls(places: np.ndarray, colours: np.ndarray) -> Gaussians:
    count = len(places)
    return Gaussians(
        means=torch.from_numpy(places).float(),
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        log_scales=torch.full((count, 3), float(np.log(0.6 * SPACING_M))),
        logit_opacities=torch.full((count,), 4.0),
        sh=torch.from_numpy((colours - 0.5) / 0.28209).float()[:, None],
        source_frame=torch.zeros(count, dtype=torch.int64),
    )


@pytest.fixture(scope="module")
def street() -> tuple[Scene, Geometry]:
    """What one of four frames sees of a road, of walls on both sides, 3 m high, and of one at its end."""
    cameras = tuple(Camera(60.0, 60.0, 40.0, 24.0, *SIZE).moved(ahead_m=0.5 * k) for k in range(4))
    along, across, up = (np.arange(low, high, SPACING_M) for low, high in ((-4, 30), (-9, 9), (-1.5, 1.5)))
    walls = [np.stack(np.meshgrid([x], up, along), -1).reshape(-1, 3) for x in (-WALL_M, WALL_M)]
    road = np.stack(np.meshgrid(across, [HEIGHT_M], along), -1).reshape(-1, 3)
    end = np.stack(np.meshgrid(across, up, [30.0]), -1).reshape(-1, 3)
    places = np.concatenate([*walls, road, end])
    colours = np.repeat([[0.8, 0.3, 0.3], [0.3, 0.3, 0.8], [0.4, 0.4, 0.4], [0.8, 0.8, 0.2]],
                        [len(walls[0]), len(walls[1]), len(road), len(end)], axis=0)  # fmt: skip
    seen = np.any([each.shows(each.project(places)) for each in cameras], axis=0)
    scene = Scene(
        static=balls(places[seen], colours[seen]),
        dynamic=balls(places[:0], colours[:0]),
        deformation=None,
        actors=(),
        sky=None,
        exposure=None,
        cameras=cameras,
        times_s=0.1 * np.arange(4),
        held_out=np.zeros(4, bool),
        provenance=Provenance(up=(0.0, -1.0, 0.0)),
    )
    blank = np.zeros((4, *SIZE[::-1]), np.float32)
    geometry = Geometry(
        cameras=cameras,
        depth_m=blank,
        confidence=blank,
        sky=np.stack([_sky(scene, k) for k in range(4)]),
        moving=blank,
        fixed_regions=blank[:1].astype(np.int64),
        region_names=(),
        scale=Scale("poses", 0.0),
        focal=Focal(60.0, True),
        ground=Ground(np.array([0.0, -1.0, 0.0]), HEIGHT_M),
    )
    return scene, geometry


def _sky(scene: Scene, view: int) -> np.ndarray:
    seen = render_scene(scene, scene.cameras[view], 0.0)
    return (seen.alpha < 0.5).numpy()


def test_walls_go_on_beyond_the_border(street: tuple[Scene, Geometry]) -> None:
    scene, geometry = street
    made = beyond_borders(scene, geometry, [0], 9.0)
    assert made.static.filled is not None
    added = made.static.select(made.static.filled)
    assert 100 < len(added) < len(scene.static)
    places = added.means.double().numpy()
    walls = np.abs(np.abs(places[:, 0]) - WALL_M) < 1e-4
    road = np.abs(places[:, 1] - HEIGHT_M) < 1e-4
    assert (walls | road).all()
    assert walls.sum() > 50
    assert road.sum() > 50
    right = added.sh[torch.from_numpy(walls & (places[:, 0] > 0)), 0]
    assert (right[:, 2] > right[:, 0]).all()  # the colour of their own wall
    for camera in scene.cameras:
        assert not camera.shows(camera.project(places)).any()


@pytest.mark.parametrize("aside_m", [-2.0, 2.0])
def test_views_aside_have_no_hole(street: tuple[Scene, Geometry], aside_m: float) -> None:
    scene, geometry = street
    made = completed(scene, geometry, CompletionOptions())
    there = scene.cameras[0].moved(aside_m)
    before, after = (render_scene(each, there, 0.0).alpha.numpy() for each in (scene, made))
    below = slice(SIZE[1] // 2, None)  # the horizon
    assert (before[below] < 0.5).sum() > 50
    assert (after[below] > 0.5).all()


def test_what_was_recorded_stays(street: tuple[Scene, Geometry]) -> None:
    scene, geometry = street
    made = completed(scene, geometry, CompletionOptions())
    for camera in scene.cameras:
        was, now = (render_scene(each, camera, 0.0).colour.numpy() for each in (scene, made))
        changed = np.abs(was - now).max(axis=2) > 0.05
        assert not changed[:, 4:-4].any()
    assert len(made.without_filled().static) == len(scene.static)


def test_nothing_made_up_stands_in_the_way(street: tuple[Scene, Geometry]) -> None:
    scene, geometry = street
    near = replace(scene, static=balls(np.array([[2.5, 0.0, 4.0]]), np.array([[1.0, 0, 0]])))
    for ground in (geometry.ground, None):
        assert len(beyond_borders(near, replace(geometry, ground=ground), [0], 9.0).static) == 1


def test_road_users_are_not_cut_twice(street: tuple[Scene, Geometry]) -> None:
    scene, geometry = street
    users = replace(geometry, road_users=np.ones(geometry.sky.shape, np.uint16))
    assert len(beyond_borders(scene, users, [0], 9.0).static) == len(scene.static)


def test_near_the_path_walls_go_on_and_trees_do_not(street: tuple[Scene, Geometry]) -> None:
    scene, geometry = street
    along, up = np.arange(9, 18, 0.2), np.arange(-1.5, 1, 0.2)
    places = np.stack(np.meshgrid([6.0], up, along), -1).reshape(-1, 3)
    spread = np.random.default_rng(0).uniform(-1.4, 1.4, len(places))
    tree = places + spread[:, None] * [1.0, 0, 0]
    path = scene.trajectory.world_from_camera[:, :3, 3]
    near = []
    for each in (places, tree):
        made = beyond_borders(replace(scene, static=balls(each, np.ones_like(each))), geometry, [0], 9.0)
        added = made.static.means[len(each) :, [0, 2]].double().numpy()
        assert len(added)
        away = np.linalg.norm(added[:, None] - path[None, :, [0, 2]], axis=2).min(axis=1)
        near.append(int((away < 7.9).sum()))
    assert near[0] > 50
    assert near[1] == 0


CAR_M, AT_M = 3.0, 4.0


def with_car(street: tuple[Scene, Geometry], *, moves: bool = False) -> tuple[Scene, Geometry]:
    """The flank of a car that begins in the picture, 3 m to the right, and reaches out of it."""
    scene, geometry = street
    flank = np.stack(np.meshgrid([CAR_M], np.arange(0, 1.4, 0.1), np.arange(AT_M, 7, 0.1)), -1).reshape(-1, 3)
    inside = np.any([each.shows(each.project(flank)) for each in scene.cameras], axis=0)
    car = balls(flank[inside], np.repeat([[0.1, 0.7, 0.2]], inside.sum(), axis=0))
    last = replace(scene.static, source_frame=torch.full((len(scene.static),), 3))
    parked = replace(scene, static=last).with_standing(car)
    users = np.zeros((4, *SIZE[::-1]), np.uint16)  # the last view shows none
    for view, camera in enumerate(scene.cameras[:3]):
        at = camera.project(flank[inside])
        columns, rows = at[camera.shows(at), :2].astype(int).T
        users[view, rows.min() : rows.max() + 1, columns.min() :] = 7
    moving = np.where(users > 0, np.float32(moves), 0).astype(np.float32)
    return parked, replace(geometry, road_users=users, moving=moving)


def test_a_car_that_the_border_cuts_off_is_closed_there(street: tuple[Scene, Geometry]) -> None:
    parked, geometry = with_car(street)
    made = with_vehicles_closed(parked, geometry)
    assert made.static.filled is not None
    added = made.static.select(made.static.filled)
    assert len(added) > 20
    places = added.means.double().numpy()
    # The flank turns a corner where the first view ends, and is no second car.
    assert (places[:, 0] > CAR_M - 1e-3).all()
    assert np.ptp(places[:, [0, 2]], axis=0).max() < 1.5
    assert (added.sh[:, 0, 1] > added.sh[:, 0, 0]).all()
    for camera in parked.cameras:
        assert not camera.shows(camera.project(places)).any()


def test_a_car_that_moves_or_is_whole_somewhere_is_not_closed(street: tuple[Scene, Geometry]) -> None:
    parked, geometry = with_car(street, moves=True)
    assert with_vehicles_closed(parked, geometry) is parked
    parked, geometry = with_car(street)
    assert geometry.road_users is not None
    whole = geometry.road_users.copy()
    whole[1] = np.roll(whole[1], -10, axis=1)
    whole[1, :, -10:] = 0
    assert with_vehicles_closed(parked, replace(geometry, road_users=whole)) is parked
    assert with_vehicles_closed(parked, replace(geometry, road_users=None)) is parked


def test_holes_beside_a_road_user_are_no_part_of_it(street: tuple[Scene, Geometry]) -> None:
    scene, geometry = street
    users = torch.zeros(len(scene.static), dtype=torch.bool)
    green = []
    parked, _ = with_car(street)
    for marked in (False, True):
        marks = torch.cat([users, torch.full((len(parked.static) - len(users),), marked)])
        made = without_holes(parked, geometry, [0], [2.0], marks, torch.device("cpu"))
        added = made.static.select(torch.arange(len(parked.static), len(made.static)))
        green.append(int((added.sh[:, 0, 1] > added.sh[:, 0, 0] + 0.1).sum()))
    assert green[0] >= 10
    assert green[1] < green[0] / 2


def test_nothing_is_completed_where_that_is_not_asked_or_nothing_stands(
    street: tuple[Scene, Geometry],
) -> None:
    scene, geometry = street
    assert completed(scene, geometry, CompletionOptions(aside_m=0.0)) is scene
    empty = replace(scene, static=scene.static.select(torch.zeros(0, dtype=torch.int64)))
    assert completed(empty, geometry, CompletionOptions()) is empty
