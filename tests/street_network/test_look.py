"""What comes out of the network's answers."""

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.street_network import LookOptions, look
from dreamdrive.street_network.prediction import Prediction
from tests.street_network.answers import FOCAL, HORIZON, LEVEL, ROLL, reading

SIZE = 256, 144


def street(size: tuple[int, int] = SIZE, users: bool = True) -> np.ndarray:
    """Sky above road, on it a car at 10 camera heights and a person at 5."""
    width, height = size
    frame = np.zeros((height, width, 3), np.uint8)
    frame[: height // 2] = LEVEL * StreetClass.SKY, 200, 0
    frame[height // 2 :] = LEVEL * StreetClass.ROAD, 20, 0
    if users:
        frame[height // 3 : height * 2 // 3, width // 8 : width // 2] = LEVEL * StreetClass.VEHICLE, 10, 1
        left, right = width * 3 // 4, width * 7 // 8
        frame[height // 3 : height * 2 // 3, left:right] = LEVEL * StreetClass.PERSON, 5, 2
    return frame


def test_depth_classes_and_road_users_are_those_of_the_answers() -> None:
    seen = look(street()[None], reading, options=LookOptions(width_px=256))
    frame = street()
    assert (seen.classes[0] == frame[..., 0] // LEVEL).mean() > 0.995
    assert [user.kind for user in seen.road_users[0]] == [StreetClass.VEHICLE, StreetClass.PERSON]
    assert (seen.instances[0] == frame[..., 2]).mean() > 0.99
    car = seen.road_users[0][0]
    assert np.allclose(car.box_px, (32, 48, 128, 96), atol=1)
    assert car.pixels == (seen.instances[0] == 1).sum()
    assert 0.8 < car.score <= 1
    sky = seen.classes[0] == StreetClass.SKY
    assert (seen.depth[0][sky] == 0).all()
    assert np.allclose(seen.depth[0][~sky], frame[..., 1][~sky], rtol=1e-3)
    assert np.allclose(seen.spread[0][~sky], np.expm1(1.148 * np.exp(-2)), rtol=2e-3)
    assert (seen.confidence > 0.9).mean() > 0.98
    assert seen.features is None


def test_an_own_car_that_comes_in_from_no_border_is_what_is_next_likely() -> None:
    frame = street(users=False)
    frame[130:] = LEVEL * StreetClass.OWN_CAR, 30, 0
    whole = look(frame[None], reading, options=LookOptions(width_px=256))
    frame[48:96, 32:128] = LEVEL * StreetClass.OWN_CAR, 10, 1
    frame[50:80, 180:200] = LEVEL * StreetClass.OWN_CAR, 12, 0

    def mistaken(pictures: torch.Tensor) -> Prediction:
        """The next likely of an own car is a vehicle on the left and a wall on the right."""
        said = reading(pictures)
        half = said.classes.shape[-1] // 2
        said.classes[:, StreetClass.VEHICLE, :, :half] += 10
        said.classes[:, StreetClass.STRUCTURE, :, half:] += 10
        said.centre[0, 0, 18, 20] = 3
        return said

    seen = look(frame[None], mistaken, options=LookOptions(width_px=256))
    assert np.array_equal(seen.own_car, whole.own_car)
    assert seen.own_car[0, 131:].all()
    # What is only taken for the own car keeps its depth.
    assert np.allclose(seen.depth[0, 132:], 30)
    car, wall = (slice(50, 94), slice(34, 126)), (slice(52, 78), slice(182, 198))
    for place, kind, depth in ((car, StreetClass.VEHICLE, 10), (wall, StreetClass.STRUCTURE, 12)):
        assert (seen.classes[0][place] == kind).all()
        assert np.allclose(seen.depth[0][place], depth)
        assert (seen.confidence[0][place] < 1e-3).all()
    (user,) = seen.road_users[0]
    assert user.kind == StreetClass.VEHICLE
    assert (seen.instances[0][car] == 1).all()


@pytest.mark.parametrize("size", [(256, 144), (512, 288), (1024, 576), (512, 768)])
def test_no_depth_lies_between_those_of_two_surfaces(size: tuple[int, int]) -> None:
    seen = look(street(size)[None], reading, options=LookOptions(width_px=256))
    solid = seen.depth[0] > 0
    near_one = np.abs(seen.depth[0][solid][:, None] / np.array([5, 10, 20]) - 1).min(axis=1)
    assert (near_one > 0.01).mean() < 1e-4


@pytest.mark.parametrize("size", [(300, 170), (640, 193), (200, 300), (17, 16)])
def test_pictures_may_have_any_size(size: tuple[int, int]) -> None:
    frame = street(size)
    seen = look(frame[None], reading, options=LookOptions(width_px=256))
    assert seen.depth.shape == frame[None].shape[:3]
    assert (seen.classes[0] == frame[..., 0] // LEVEL).mean() > 0.95


def test_the_camera_is_that_of_the_answers() -> None:
    seen = look(np.stack([street()] * 3), reading, options=LookOptions(width_px=256))
    camera = seen.camera
    assert len(seen.cameras) == 3
    assert seen.cameras[1].pitch_rad == pytest.approx(camera.pitch_rad)
    assert camera.focal_px == pytest.approx(FOCAL * 256, rel=1e-5)
    # 144 rows are continued by 8 above and 8 below, 60 rows by none above and 4 below.
    assert camera.horizon_px == pytest.approx(HORIZON * 256, rel=1e-5)
    assert camera.roll_rad == pytest.approx(ROLL)
    assert camera.focal_spread == pytest.approx(np.exp(-3))
    assert camera.distorted == pytest.approx(1 / (1 + np.exp(3)))
    low = look(street((256, 60))[None], reading, options=LookOptions(width_px=256))
    assert low.camera.horizon_px == pytest.approx(HORIZON * 256 + 2, rel=1e-5)


def test_metres_follow_from_the_height_and_the_focal_length() -> None:
    options = LookOptions(width_px=256)
    free = look(street()[None], reading, options=options)
    with pytest.raises(ValueError, match="camera heights"):
        _ = free.depth_m
    known = look(street()[None], reading, focal_px=2 * FOCAL * 256, camera_height_m=1.5, options=options)
    assert np.allclose(known.depth, 2 * free.depth, rtol=1e-5)
    assert np.allclose(known.depth_m, 3 * free.depth, rtol=1e-5)
    assert known.camera.focal_px == 2 * FOCAL * 256
    assert known.camera.focal_spread == 0


def test_frames_see_nothing_of_each_other() -> None:
    frames = np.stack([street(), street(users=False), street()])
    told: list[tuple[int, int]] = []
    options = LookOptions(width_px=256, features=True)
    seen = look(frames, reading, options=options, tell=lambda *each: told.append(each))
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert seen.road_users[1] == ()
    for index in range(3):
        alone = look(frames[index : index + 1], reading, options=options)
        assert np.array_equal(seen.depth[index], alone.depth[0])
        assert np.array_equal(seen.instances[index], alone.instances[0])
    assert seen.features is not None
    assert seen.features.shape == (3, 3, 36, 64)


@pytest.mark.parametrize(
    ("given", "said"),
    [({"focal_px": 0.0}, "focal length 0"), ({"camera_height_m": float("nan")}, "camera height nan")],
)
def test_what_cannot_be_is_refused(given: dict[str, float], said: str) -> None:
    with pytest.raises(InputError, match=said):
        look(street()[None], reading, **given)  # pyright: ignore


def test_no_frame_is_refused() -> None:
    with pytest.raises(InputError, match="no frame"):
        look(street()[None][:0], reading)


def test_a_width_that_the_network_does_not_take_is_refused() -> None:
    with pytest.raises(ValueError, match="multiple of 32"):
        look(street()[None], reading, options=LookOptions(width_px=250))
