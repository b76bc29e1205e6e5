"""Layouts are written, read back and checked; what is wrong is named."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from dreamdrive.data.layout_file import problems, read_layout, schema_text, write_layout
from dreamdrive.errors import InputError
from dreamdrive.scene.street.layout import Area, Box, Ego, Layout, TrackPoint
from dreamdrive.show import draw_layout
from streetworld import draw_street

ROOT = Path(__file__).resolve().parents[2]


def small() -> Layout:
    car = Box("ahead", "car", (4.4, 1.8, 1.5), [TrackPoint(0, 12, 0, 0), TrackPoint(2, 26, 0, 0)])
    road = Area("road", [(-20.0, -5.0), (90.0, -5.0), (90.0, 5.0), (-20.0, 5.0)])
    return Layout(Ego([TrackPoint(0, 0, 0, 0), TrackPoint(2, 14, 0, 0)]), areas=[road], boxes=[car])


@pytest.mark.parametrize("seed", range(6))
def test_drawn_layouts_are_valid_and_come_back_equal(tmp_path: Path, seed: int) -> None:
    layout = draw_street(seed)
    assert problems(layout) == []
    write_layout(layout, tmp_path / "a.json")
    assert read_layout(tmp_path / "a.json") == layout
    write_layout(read_layout(tmp_path / "a.json"), tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def square(x: float, y: float, side: float) -> list[list[float]]:
    return [[x, y], [x + side, y], [x + side, y + side], [x, y + side]]


def test_holes_apart_are_fine(tmp_path: Path) -> None:
    path = tmp_path / "street.json"
    holes = [square(0, 0, 2), square(3, 0, 2)]
    layout = read_layout(spoil(path, lambda v: v["areas"][0].update(holes=holes)))
    assert len(layout.areas[0].holes) == 2


def spoil(path: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    write_layout(small(), path)
    values = json.loads(path.read_text())
    change(values)
    path.write_text(json.dumps(values))
    return path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: v["boxes"][0].update(size_m=[4, -1, 2]), r"> 0.0 - at `\$.boxes\[0\].size_m\[1\]`"),
        (lambda v: v["boxes"][0].update(kind="tank"), r"'tank' - at `\$.boxes\[0\].kind`"),
        (lambda v: v["boxes"][0].pop("track"), r"`track` - at `\$.boxes\[0\]`"),
        (lambda v: v["boxes"][0].update(track=[]), r"length >= 1 - at `\$.boxes\[0\].track`"),
        (lambda v: v["areas"][0]["polygon"].__setitem__(0, [1]), r"at `\$.areas\[0\].polygon\[0\]`"),
        (lambda v: v.update(boxs=[]), r"unknown field `boxs`"),
        (lambda v: v.pop("ego"), r"`ego`"),
        (lambda v: v.update(format=9), r"at `\$.format`"),
        (lambda v: v["ego"]["track"][1].update(t_s=0), r"\$.ego.track\[1\].t_s: expected more than 0"),
        (lambda v: v["boxes"].append(v["boxes"][0]), r"\$.boxes\[1\].id: 'ahead' is taken"),
        (
            lambda v: v["areas"][0].update(polygon=[[0, 0], [1, 1], [1, 0], [0, 1]]),
            r"\$.areas\[0\].polygon: Self-intersection",
        ),
        (
            lambda v: v["areas"][0].update(holes=[square(0, 0, 2), [[5, 0], [7, 2], [7, 0], [5, 2]]]),
            r"\$.areas\[0\].holes\[1\]: Self-intersection",
        ),
        (
            lambda v: v["areas"][0].update(holes=[square(0, 0, 2), square(0, 4, 4)]),
            r"\$.areas\[0\].holes\[1\]: reaches out of the polygon",
        ),
        (
            lambda v: v["areas"][0].update(holes=[square(0, 0, 2), square(1, 1, 2)]),
            r"\$.areas\[0\].holes\[1\]: overlaps an earlier hole",
        ),
        (
            lambda v: v.update(boxes=[{**v["boxes"][0], "id": str(i)} for i in range(256)]),
            r"\$.boxes: 256 boxes; expected at most 255",
        ),
    ],
)
def test_the_wrong_field_is_named(
    tmp_path: Path, change: Callable[[dict[str, Any]], None], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_layout(spoil(tmp_path / "street.json", change))


def test_what_is_no_layout_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "street.json"
    path.write_text("{")
    with pytest.raises(InputError, match=r"is not JSON: Input data was truncated; expected a layout as JSON"):
        read_layout(path)
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_layout(tmp_path / "none.json")


def test_the_published_schema_is_the_one_that_is_checked() -> None:
    assert (ROOT / "docs" / "layout.schema.json").read_text() == schema_text()


def test_the_drawing_shows_the_boxes_where_they_are() -> None:
    """A box that stands is a filled outline: of its size, and moved by as much as it is moved."""

    def drawn(x_m: float, y_m: float, size_m: tuple[float, float, float]) -> np.ndarray:
        box = Box("", "car", size_m, [TrackPoint(0, x_m, y_m, 0)])
        picture = draw_layout(msgspec.structs.replace(small(), boxes=[box]), 2.0)
        empty = draw_layout(msgspec.structs.replace(small(), boxes=[]), 2.0)
        return (picture != empty).any(axis=-1)

    def middle(mask: np.ndarray) -> np.ndarray:
        return np.argwhere(mask).mean(axis=0)

    here, ahead, left = drawn(20, 0, (4, 2, 1.5)), drawn(30, 0, (4, 2, 1.5)), drawn(20, 4, (4, 2, 1.5))
    px_per_m = (middle(ahead) - middle(here))[1] / 10
    assert px_per_m > 1
    np.testing.assert_allclose((middle(ahead) - middle(here))[0], 0, atol=0.5)
    np.testing.assert_allclose(middle(left) - middle(here), [-4 * px_per_m, 0], atol=0.7)
    extent = np.ptp(np.argwhere(here), axis=0) + 1
    np.testing.assert_allclose(extent, [2 * px_per_m, 4 * px_per_m], atol=5)  # smooth edges add some
    longer = np.ptp(np.argwhere(drawn(20, 0, (8, 2, 1.5))), axis=0) + 1
    np.testing.assert_allclose(longer - extent, [0, 4 * px_per_m], atol=1.5)


def test_the_drawing_shows_the_way_of_a_box() -> None:
    standing = msgspec.structs.replace(small().boxes[0], track=small().boxes[0].track[:1])
    moving = draw_layout(small(), 2.0)
    still = draw_layout(msgspec.structs.replace(small(), boxes=[standing]), 2.0)
    assert (moving != still).any(axis=-1).sum() > 50
