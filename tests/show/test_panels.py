import numpy as np
import pytest

from dreamdrive.show import panels


def image(value: int) -> np.ndarray:
    return np.full((90, 160, 3), value, dtype=np.uint8)


def test_beside_keeps_both_pictures_apart_from_the_labels() -> None:
    both = panels.grid({"recorded": image(10), "rendered": image(200)})
    assert both.shape == (90, 320, 3)
    assert (both[40:, :160] == 10).all()
    assert (both[40:, 160:] == 200).all()
    assert (both[:30, :160] != 10).any()


def test_parts_and_grid_fill_rows_and_leave_the_rest_black() -> None:
    assert panels.grid({name: image(value) for value, name in enumerate("abcd", 1)}).shape == (180, 320, 3)
    three = panels.grid({"a": image(9), "b": image(9), "c": image(9)}, columns=2)
    assert (three[90:, 160:] == 0).all()


def test_different_sizes_are_refused() -> None:
    with pytest.raises(ValueError, match="one size"):
        panels.grid({"a": image(1), "b": image(1)[:50]}, columns=2)


def test_labels_do_not_touch_the_input() -> None:
    plain = image(100)
    panels.labelled(plain, "label")
    assert (plain == 100).all()


def test_depth_colours_go_from_red_to_blue_and_mark_nothing_black() -> None:
    colours = panels.depth_colours(np.array([[2.0, 80.0, 0.0]])).astype(int)
    assert colours[0, 0, 0] > colours[0, 0, 2]
    assert colours[0, 1, 2] > colours[0, 1, 0]
    assert (colours[0, 2] == 0).all()


def test_score_colours_grow_brighter() -> None:
    brightness = panels.score_colours(np.linspace(0, 1, 11)[None]).astype(int).sum(-1)[0]
    assert brightness[0] < 20
    assert (np.diff(brightness) > 0).all()
