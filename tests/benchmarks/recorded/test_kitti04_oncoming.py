"""Which of the listed cars a scene has as things that approach, on scenes made of a car's box."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.motion import DeformationConfig, DeformationField, Domain, Tracks
from dreamdrive.scene.actor import Actor, Track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive_bench.recorded.kitti04_oncoming import CARS, SIZE, OncomingCar, figures
from tests.scene.scenes import gaussians

WHITE, DARK, DISTANT = CARS
FRAMES = list(range(0, 48, 2))


def scene_with(car: OncomingCar, speed_m_s: float = -14.0, aside_px: float = 0.0, views: int = 24) -> Scene:
    """One actor that fills the boxes of a car; its track says that it goes at this speed."""
    times_s = np.arange(views) / 5
    pose = np.eye(4)
    camera = Camera(276.8, 275.2, 235.6, 71.3, 480, 144, pose)
    scale = np.array([480 / SIZE[0], 144 / SIZE[1]])
    frames = sorted(car.boxes)
    boxes = np.array([np.array(car.boxes[frame]).reshape(2, 2) * scale for frame in frames])
    column, row = (np.interp(times_s, np.array(frames) / 10, boxes.mean(axis=1)[:, k]) for k in (0, 1))
    wide = np.interp(times_s, np.array(frames) / 10, np.ptp(boxes, axis=1)[:, 0])
    depth_m = camera.fx_px * 2.0 / wide
    places = np.stack(
        [
            camera.lift(np.array([[c + aside_px, r, z]]))[0]
            for c, r, z in zip(column, row, depth_m, strict=True)
        ]
    )
    high = float(np.ptp(boxes, axis=1)[:, 1].mean() / np.ptp(boxes, axis=1)[:, 0].mean())
    cloud = np.random.default_rng(0).uniform(-1, 1, (300, 3)) * [1.0, high, 0.0]
    dynamic = replace(
        gaussians(300, 0),
        means=torch.tensor(cloud, dtype=torch.float32),
        lifespan=torch.tensor([[2.0, 100.0]]).repeat(300, 1),
        actor=torch.zeros(300, dtype=torch.int64),
    )
    moves = Tracks(times_s, places[None], np.zeros((1, views)), np.zeros((1, 3)))
    domain = Domain(np.zeros(3), 1.0, 0.0, 4.6, np.array([0, -1.0, 0]))
    field = DeformationField(DeformationConfig(actors=1, track_times=views), domain, moves)
    field.requires_grad_(False)
    told = np.zeros((views, 3))
    told[:, 2] = speed_m_s * times_s
    track = Track(times_s, told, np.zeros(views))
    return Scene(
        static=gaussians(1, 1),
        dynamic=dynamic,
        deformation=field,
        actors=(Actor(0, "actor 0", "vehicle", 300, track),),
        sky=None,
        exposure=None,
        cameras=(camera,) * views,
        times_s=times_s,
        held_out=np.zeros(views, bool),
    )


def test_the_list_is_of_boxes_inside_the_picture_in_frames_that_show_the_car() -> None:
    for car in CARS:
        assert len(car.boxes) >= 2
        for frame, (left, top, right, bottom) in car.boxes.items():
            assert car.first <= frame <= car.last
            assert 0 <= left < right <= SIZE[0]
            assert 0 <= top < bottom <= SIZE[1]


@pytest.mark.parametrize("car", [WHITE, DARK], ids=lambda car: car.name)
def test_an_actor_in_the_boxes_of_a_car_that_comes_is_that_car(car: OncomingCar) -> None:
    row = figures(scene_with(car), FRAMES)
    assert row["oncoming"][car.name] == "approaches"
    assert (row["oncoming_listed"], row["oncoming_judged"], row["oncoming_approaching"]) == (3, 2, 1)
    other = DARK if car is WHITE else WHITE
    assert row["oncoming"][other.name] == "missed: no actor where it is"


def test_what_goes_forward_or_is_elsewhere_is_not_the_car() -> None:
    stands = figures(scene_with(DARK, speed_m_s=5.0), FRAMES)["oncoming"][DARK.name]
    assert stands == "missed: actor 0 is where it is, but goes forward at 5.0 m/s"
    beside = figures(scene_with(DARK, aside_px=40), FRAMES)["oncoming"][DARK.name]
    assert beside == "missed: no actor where it is"


def test_what_is_tiny_is_listed_and_not_judged() -> None:
    row = figures(scene_with(DARK), FRAMES)
    assert row["oncoming"][DISTANT.name] == "too small to judge"


def test_a_run_without_the_frames_of_a_car_says_so() -> None:
    row = figures(scene_with(DARK, views=11), list(range(26, 48, 2)))
    assert row["oncoming"][DARK.name] == "missed: none of its listed frames is in the run"
    assert row["oncoming_approaching"] == 0


def test_an_actor_that_has_died_is_not_there() -> None:
    scene = scene_with(DARK)
    early = replace(scene.dynamic, lifespan=torch.tensor([[-5.0, 0.01]]).repeat(300, 1))
    row = figures(replace(scene, dynamic=early), FRAMES)
    assert row["oncoming_approaching"] == 0
