from dataclasses import replace
from math import nan, radians, tan
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive_train.street_network.data.mixture import read_entries
from dreamdrive_train.street_network.data.picture import (
    Picture,
    centred,
    continued,
    cut,
    mirrored,
    read_entry,
    turned,
)
from dreamdrive_train.street_network.data.records import UNKNOWN
from tests.records import write_folder

WIDTH, HEIGHT = 320, 200


def with_horizon(horizon: float, roll_rad: float) -> Picture:
    """White below the horizon; a camera that is turned clockwise sees it rise on the right."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    below = rows - HEIGHT / 2 > horizon * WIDTH - (columns - WIDTH / 2) * tan(roll_rad)
    flat = below.astype(np.uint8)
    rgb = np.repeat(255 * flat[..., None], 3, axis=2)
    return Picture(rgb, flat, flat, flat.astype(np.uint16), 0.8, horizon, roll_rad, 1.5, 0.0)


def seen(picture: Picture) -> tuple[float, float]:
    """Horizon and roll as the picture shows them."""
    width, height = picture.size
    edge = height / 2 - (picture.rgb[..., 0] > 127).sum(axis=0)
    slope, middle = np.polyfit(np.arange(width) + 0.5 - width / 2, edge, 1)
    return middle / width, -float(np.arctan(slope))


@pytest.mark.parametrize("clockwise_deg", [-4.0, 3.0])
def test_a_turned_camera_sees_what_it_says(clockwise_deg: float) -> None:
    picture = turned(with_horizon(0.04, 0.03), clockwise_deg)
    assert picture.roll_rad == pytest.approx(0.03 + radians(clockwise_deg))
    assert seen(picture) == pytest.approx((picture.horizon, picture.roll_rad), abs=0.004)


def test_a_mirrored_camera_sees_what_it_says() -> None:
    picture = mirrored(with_horizon(0.04, 0.06))
    assert seen(picture) == pytest.approx((0.04, -0.06), abs=0.004)
    assert (picture.horizon, picture.roll_rad) == (0.04, -0.06)


@pytest.mark.parametrize("size", [(160, 96), (96, 96)])
def test_a_part_about_the_middle_has_a_longer_focal_length(size: tuple[int, int]) -> None:
    picture = centred(with_horizon(0.04, 0.0), size, 0.5)
    assert picture.size == size
    assert picture.labels.shape == (size[1] // 2, size[0] // 2)
    share = 0.5 * min(1, HEIGHT * size[0] / size[1] / WIDTH)
    assert picture.focal == pytest.approx(0.8 / share, rel=0.01)
    assert seen(picture)[0] == pytest.approx(picture.horizon, abs=0.006)


def test_labels_stay_below_their_pixels() -> None:
    rng = np.random.default_rng(0)
    blocks = cv2.resize(rng.integers(0, 255, (10, 16), np.uint8), (320, 200), interpolation=cv2.INTER_NEAREST)
    picture = replace(with_horizon(0, 0), rgb=np.repeat(blocks[..., None], 3, axis=2), labels=blocks)
    part = cut(picture, (40, 20, 200, 120), (200, 120))
    np.testing.assert_array_equal(part.labels, part.rgb[::2, ::2, 0])


def test_nothing_is_known_of_what_a_turn_brings_in() -> None:
    picture = turned(with_horizon(0, 0), 10.0)
    assert picture.labels[0, -1] == UNKNOWN or picture.labels[0, 0] == UNKNOWN
    assert set(np.unique(picture.depth)) <= {0, 1}


def test_a_record_is_read_with_its_truth(tmp_path: Path) -> None:
    (record, *_) = write_folder(tmp_path / "r", range(1_000_000, 1_000_001), frames=1)
    picture = read_entry(read_entries([tmp_path / "r"])[0])
    assert picture.size == (128, 80)
    assert record.focal_px is not None
    assert picture.focal == pytest.approx(record.focal_px / 128)
    assert len(np.unique(picture.labels)) > 4
    assert picture.depth.dtype == np.uint16


def test_pictures_of_another_size_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / "r"
    write_folder(folder, range(1_000_000, 1_000_001), frames=1)
    cv2.imwrite(str(folder / "1000000-0-depth.png"), np.zeros((3, 4), np.uint16))
    with pytest.raises(InputError, match=r"uint16 of \(3, 4\); expected uint16 of \(80, 128\)"):
        read_entry(read_entries([folder])[0])


def test_what_is_not_known_stays_so() -> None:
    picture = replace(with_horizon(0, 0), focal=nan, horizon=nan, roll_rad=nan)
    part = mirrored(turned(centred(picture, (96, 64)), 3.0))
    assert np.isnan([part.focal, part.horizon, part.roll_rad]).all()


def test_flat_pictures_are_continued_above_and_below() -> None:
    picture = with_horizon(0.04, 0.0)
    width, height = picture.size
    square = continued(picture, (64, 64), 0.9)
    assert square.size == (width, width)
    rows = (width - height) // 2
    assert (square.rgb[:rows] == picture.rgb[0]).all()
    assert (square.rgb[rows:-rows] == picture.rgb).all()
    assert (square.labels[:rows] == 255).all()
    assert (square.depth[-rows:] == 0).all()
    assert (square.focal, square.horizon) == (picture.focal, picture.horizon)
    assert continued(picture, (64, 64), 0.2).size[1] == pytest.approx(height / 0.8, abs=1)
    assert continued(picture, (640, 64), 0.2).size == picture.size
