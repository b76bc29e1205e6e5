"""The picture of all that is seen in a frame."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.show import draw_look
from dreamdrive.show.look import COLOURS
from tests.scene.street.test_look import small_look

FRAME = np.full((8, 12, 3), 100, np.uint8)


def large(times: int = 20, camera_height_m: float | None = None):
    """The small look with larger pixels."""
    seen = small_look(camera_height_m=camera_height_m)
    names = ("depth", "spread", "classes", "confidence", "instances")
    maps = {name: getattr(seen, name).repeat(times, axis=1).repeat(times, axis=2) for name in names}
    camera = replace(seen.camera, width_px=12 * times, height_px=8 * times)
    return replace(seen, **maps, camera=camera, cameras=(camera,) * 2)


def test_small_frames_are_enlarged() -> None:
    drawn = draw_look(FRAME, small_look(), 0)
    assert drawn.dtype == np.uint8
    assert drawn.shape[1] == 2 * 12 * 30
    assert drawn.shape[0] > 2 * 8 * 30


def test_every_class_has_a_colour_of_its_own() -> None:
    assert set(COLOURS) == set(StreetClass)
    assert len(set(COLOURS.values())) == len(StreetClass)


def test_panels_show_depth_classes_and_confidence() -> None:
    frame = np.full((160, 240, 3), 100, np.uint8)
    drawn = draw_look(frame, large(), 1)
    times = drawn.shape[1] // 480
    depth = drawn[: 160 * times, 240 * times :]
    assert (depth[40 * times, 60 * times] == 0).all()  # sky
    assert depth[110 * times, 60 * times].any()
    classes = drawn[160 * times : 320 * times, : 240 * times]
    tint = 0.45 * 100 + 0.55 * np.array(COLOURS[StreetClass.VEHICLE])
    assert np.allclose(classes[90 * times, 60 * times], tint, atol=1)


def test_the_horizon_is_drawn_across_the_frame() -> None:
    frame = np.full((160, 240, 3), 100, np.uint8)
    seen = large()
    with_horizon = draw_look(frame, seen, 0)
    hidden = tuple(replace(each, horizon_px=9999.0) for each in seen.cameras)
    without = draw_look(frame, replace(seen, cameras=hidden), 0)
    times = with_horizon.shape[1] // 480
    changed = (with_horizon != without).any(axis=2)[: 160 * times, : 240 * times]
    assert changed[80 * times - 3 : 80 * times + 3].any(axis=0).mean() > 0.9


@pytest.mark.parametrize("height_m", [None, 2.0])
def test_depth_has_the_same_colours_in_any_unit(height_m: float | None) -> None:
    frame = np.full((160, 240, 3), 100, np.uint8)
    drawn, plain = (draw_look(frame, large(camera_height_m=each), 0) for each in (height_m, None))
    times = drawn.shape[1] // 480
    place = 110 * times, (240 + 60) * times
    assert np.abs(drawn[place].astype(int) - plain[place]).max() <= 2
