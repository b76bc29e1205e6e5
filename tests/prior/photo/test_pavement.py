"""Ground that is hidden looks as the road does before and behind that place."""

from dataclasses import replace

import numpy as np

from dreamdrive.prior.photo import layers_of
from dreamdrive.prior.photo.pavement import AHEAD, AROUND, along_road
from dreamdrive.prior.photo.sight import sight_of
from dreamdrive.scene.street.street_class import StreetClass
from tests.prior.photo.streets import CAR, GROUND, HEIGHT, HEIGHT_M, WIDTH, street

WANTED = np.s_[34:39, CAR[1]]


def lined() -> tuple[np.ndarray, np.ndarray]:
    """A road with a line 0.2 m to the right, and where that is."""
    photo = street()
    down = np.maximum(np.arange(HEIGHT)[:, None] + 0.5 - HEIGHT / 2, 0.1)
    across_m = (np.arange(WIDTH)[None, :] + 0.5 - WIDTH / 2) * HEIGHT_M / down
    line = (np.abs(across_m - 0.2) < 0.12) & (down > 1)
    return np.where(line[..., None], 250, photo.rgb).astype(np.uint8), line


def test_a_line_goes_on_where_a_car_hid_it() -> None:
    photo = street()
    rgb, line = lined()
    wanted = np.zeros(line.shape, bool)
    wanted[WANTED] = True
    bare = (photo.classes == StreetClass.ROAD) & ~wanted
    hidden = np.where(wanted[..., None], 0, rgb).astype(np.uint8)
    found, left = along_road(hidden, photo.camera, GROUND, wanted, bare, AROUND)
    assert not left.any()
    bright = found[WANTED].min(2) > 170
    assert (bright == line[WANTED]).mean() > 0.9
    np.testing.assert_array_equal(found[~wanted], rgb[~wanted])


def test_what_finds_no_bare_ground_is_left() -> None:
    photo = street()
    wanted = np.zeros(photo.classes.shape, bool)
    wanted[-3:] = True
    rgb = photo.rgb.copy()
    found, left = along_road(rgb, photo.camera, GROUND, wanted, np.zeros_like(wanted), AHEAD)
    np.testing.assert_array_equal(left, wanted)
    np.testing.assert_array_equal(found, rgb)


def test_a_car_that_drives_on_uncovers_the_line() -> None:
    photo = street()
    rgb, line = lined()
    shown = np.where((photo.road_users > 0)[..., None], photo.rgb, rgb).astype(np.uint8)
    layers = layers_of(replace(photo, rgb=shown), leaving=[1])
    sight = sight_of(layers.at(1.0, np.array([[0.0, 0.0, 15.0]])), photo.camera, GROUND)
    rows = np.s_[35:38, CAR[1]]
    assert sight.rgb[rows][line[rows]].min(1).mean() > sight.rgb[rows][~line[rows]].min(1).mean() + 60
