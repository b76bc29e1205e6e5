import cv2
import numpy as np
import pytest

from dreamdrive.geometry.evidence import masks, observe
from tests.geometry.toy_drive import HEIGHT, HOOD_ROWS, WIDTH, make_clip, straight

STEPS = [0.5] * 9


@pytest.fixture(scope="module")
def plain() -> np.ndarray:
    return make_clip(straight(STEPS)).frames[..., 0]


def find(grey: np.ndarray) -> masks.Fixed:
    moving = np.ones(len(grey), bool)
    return masks.find_fixed(grey, np.ones(grey.shape[1:], bool), moving, (WIDTH, HEIGHT))


def test_a_plain_street_has_no_fixed_region(plain: np.ndarray) -> None:
    fixed = find(plain)
    assert fixed.names == ()
    assert not fixed.regions.any()


def test_a_strip_of_bonnet_is_found_and_named() -> None:
    fixed = find(make_clip(straight(STEPS), hood=True).frames[..., 0])
    assert fixed.names == ("bonnet",)
    assert (fixed.regions[-HOOD_ROWS + 1 :] == 1).all()
    assert not fixed.regions[: -HOOD_ROWS - 5].any()


def test_black_bars_are_found_and_named(plain: np.ndarray) -> None:
    barred = plain.copy()
    barred[:, :, :24] = 3
    fixed = find(barred)
    assert "bar" in fixed.names
    bar = fixed.regions == 1 + fixed.names.index("bar")
    assert bar[:, :24].all()
    assert not bar[:, 30:].any()


def test_text_over_the_picture_is_an_overlay(plain: np.ndarray) -> None:
    written = plain.copy()
    for frame in written:
        cv2.putText(frame, "2024-05-01 12:00", (8, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.6, 255, 2)
    fixed = find(written)
    assert fixed.names == ("mirror or overlay",)
    assert fixed.regions[10:26, 12:150].mean() > 0.6
    assert not fixed.regions[60:].any()


def test_a_lead_car_at_a_constant_distance_is_an_object_and_no_region(plain: np.ndarray) -> None:
    followed = plain.copy()
    rng = np.random.default_rng(0)
    for index, frame in enumerate(followed):
        shift = int(rng.integers(-1, 2))
        cv2.rectangle(frame, (150 + shift, 110), (190 + shift, 150), 240, -1)
        cv2.rectangle(frame, (156 + shift, 118 + index % 2), (184 + shift, 130), 20, -1)
    fixed = find(followed)
    assert fixed.names == ()
    assert fixed.objects[105:155, 145:195].any()


def test_a_standing_clip_gives_no_bonnet() -> None:
    clip = make_clip(straight([0.0] * 5), hood=True)
    assert observe(clip).fixed.names == ()


def test_traffic_past_a_standing_camera_is_no_motion(plain: np.ndarray) -> None:
    still = np.repeat(plain[:1], 10, axis=0)
    for index, frame in enumerate(still):
        frame[90:150, 20 + 12 * index : 110 + 12 * index] = plain[5, 20:80, 100:190]
    clip = make_clip(straight([0.0] * 9))
    frames = np.repeat(still[..., None], 3, axis=-1)
    seen = observe(type(clip)(**{**vars(clip), "frames": frames}))
    assert seen.motion.standing
    assert not seen.motion.moving.any()
