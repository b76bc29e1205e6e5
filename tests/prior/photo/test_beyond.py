"""The street beyond a photo: lane lines go on, and so does who is cut off."""

from dataclasses import replace

import numpy as np

from dreamdrive.prior.photo.beyond import widened
from dreamdrive.scene.street.street_class import StreetClass
from tests.prior.photo.streets import CAR_M, FOCAL_PX, HEIGHT, HEIGHT_M, WIDTH, street

MARGIN = 24


def test_a_lane_line_goes_on_straight_below_the_photo() -> None:
    photo = street()
    down = np.maximum(np.arange(HEIGHT)[:, None] + 0.5 - HEIGHT / 2, 0.1)
    across_m = (np.arange(WIDTH)[None, :] + 0.5 - WIDTH / 2) * HEIGHT_M / down
    line = (np.abs(across_m - 0.9) < 0.12) & (photo.classes == StreetClass.ROAD)
    rgb = np.where(line[..., None], 250, photo.rgb).astype(np.uint8)
    wide = widened(replace(photo, rgb=rgb), MARGIN)
    assert wide.rgb.shape == (HEIGHT + MARGIN, WIDTH + 2 * MARGIN, 3)
    for row in (HEIGHT + 3, HEIGHT + 12):
        there = MARGIN + WIDTH / 2 + 0.9 / HEIGHT_M * (row + 0.5 - HEIGHT / 2)
        bright = np.flatnonzero(wide.rgb[row].min(1) > 160)
        assert abs(bright.mean() - there) < 2
        assert np.ptp(bright) < 12
    plane = HEIGHT_M * FOCAL_PX / (np.arange(HEIGHT, HEIGHT + MARGIN) + 0.5 - HEIGHT / 2)
    np.testing.assert_allclose(wide.depth_m[HEIGHT:, MARGIN + 20], plane, rtol=1e-5)


def test_who_is_cut_off_goes_on_and_who_is_not_does_not() -> None:
    photo = street()
    cut = np.s_[27:39, WIDTH - 10 :]
    road_users, classes, depth = photo.road_users.copy(), photo.classes.copy(), photo.depth_m.copy()
    road_users[cut], classes[cut], depth[cut] = 2, StreetClass.VEHICLE, CAR_M
    wide = widened(replace(photo, road_users=road_users, classes=classes, depth_m=depth), MARGIN)
    beyond = np.s_[28:38, MARGIN + WIDTH : MARGIN + WIDTH + 9]
    assert (wide.road_users[beyond] == 2).all()
    assert (wide.classes[beyond] == StreetClass.VEHICLE).all()
    np.testing.assert_allclose(wide.depth_m[beyond], CAR_M)
    assert (wide.road_users[:, : MARGIN + 1] == 0).all()
    assert (wide.road_users == 1).sum() == (road_users == 1).sum()
