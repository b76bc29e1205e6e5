"""Boxes of vehicles that show an end, a flank or all of themselves."""

import numpy as np
import pytest

from dreamdrive.decompose.actors.body import body_of
from dreamdrive.decompose.actors.life_spans import ActorView
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground

AHEAD, UP = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])
GROUND = Ground(UP, 1.5)
REAR_M = 12.0  # of the vehicle, before the camera
CAR_M, TRUCK_M = (4.4, 1.85, 1.5), (8.0, 2.4, 3.0)


def view() -> ActorView:
    camera = Camera(150, 150, 160, 96, 320, 192, np.eye(4))
    return ActorView(0.0, camera, np.eye(4), np.zeros((0, 3)), np.zeros((192, 320), np.float32))


def surface(size_m: tuple[float, float, float], *sides: str, right_m: float = 0.0) -> np.ndarray:
    """Points of a box that stands on the road, its rear ``REAR_M`` ahead; 0.2 m over the road is its edge."""
    long_m, wide_m, tall_m = size_m
    across, along, up = np.meshgrid(
        np.linspace(-wide_m / 2, wide_m / 2, 15), np.linspace(0, long_m, 25), np.linspace(0.2, tall_m, 15)
    )
    chosen = np.zeros(across.shape, bool)
    for side, at in (("rear", along == 0), ("left", across == across.min()), ("front", along == long_m)):
        chosen |= at if side in sides else False
    return np.stack([right_m + across, 1.5 - up, REAR_M + along], axis=-1)[chosen]


@pytest.mark.parametrize("size_m", [CAR_M, TRUCK_M])
def test_a_rear_alone_becomes_a_usual_vehicle(size_m: tuple[float, float, float]) -> None:
    body = body_of(surface(size_m, "rear"), AHEAD, UP, [view()], "vehicle", GROUND)
    np.testing.assert_allclose(body.size_m, size_m, atol=0.12)
    np.testing.assert_allclose(body.foot_m, [0, 1.5, REAR_M + size_m[0] / 2], atol=0.1)


@pytest.mark.parametrize(("under_m", "length_m"), [(0.9, 8.0), (2.0, 4.4)])
def test_a_lorry_is_as_high_as_it_reaches_over_the_road(under_m: float, length_m: float) -> None:
    """What is seen of it begins at the edge of its box; what hangs much higher is no lorry."""
    rear = surface(TRUCK_M, "rear")
    seen = rear[1.5 - rear[:, 1] > under_m]
    body = body_of(seen, AHEAD, UP, [view()], "vehicle", GROUND)
    assert body.size_m[0] == pytest.approx(length_m, abs=0.1)


def test_a_front_alone_reaches_away_from_the_eye() -> None:
    """It comes towards the camera: its front is the near end."""
    body = body_of(surface(CAR_M, "rear"), -AHEAD, UP, [view()], "vehicle", GROUND)
    np.testing.assert_allclose(body.foot_m, [0, 1.5, REAR_M + CAR_M[0] / 2], atol=0.1)


def test_a_flank_alone_is_given_a_width_away_from_the_eye() -> None:
    """It is right of the camera, which sees its left side."""
    body = body_of(surface(CAR_M, "left", right_m=3.0), AHEAD, UP, [view()], "vehicle", GROUND)
    np.testing.assert_allclose(body.size_m, CAR_M, atol=0.2)
    np.testing.assert_allclose(body.foot_m, [3.0, 1.5, REAR_M + CAR_M[0] / 2], atol=0.1)


def test_what_was_seen_from_all_sides_is_as_large_as_it_is() -> None:
    size_m = (4.8, 1.9, 1.6)
    body = body_of(surface(size_m, "rear", "left", "front"), AHEAD, UP, [view()], "vehicle", GROUND)
    np.testing.assert_allclose(body.size_m, size_m, atol=0.12)


@pytest.mark.parametrize(("kind", "length_m"), [("person", 0.6), ("two-wheeler", 1.8)])
def test_small_road_users_have_their_usual_size(kind: str, length_m: float) -> None:
    """What one frame sees of them is less than how far off their depth is."""
    points = np.random.default_rng(0).normal([0.0, 0.6, 9.0], [0.2, 0.4, 0.8], (200, 3))
    body = body_of(points, AHEAD, UP, [view()], kind, GROUND)
    assert body.size_m[:2] == pytest.approx([length_m, 0.6])


def test_a_bottom_far_from_the_road_stays_there() -> None:
    points = surface(CAR_M, "rear") - [0, 2.0, 0]
    body = body_of(points, AHEAD, UP, [view()], "vehicle", GROUND)
    assert body.foot_m[1] == pytest.approx(1.5 - 2.2, abs=0.1)
    assert body_of(points, AHEAD, UP, [view()], "vehicle", None).foot_m[1] == pytest.approx(-0.7, abs=0.1)
