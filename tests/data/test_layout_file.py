"""Layouts are written, read back and checked; what is wrong is named."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dreamdrive.data.layout_file import problems, read_layout, schema_text, write_layout
from dreamdrive.data.layout_picture import draw_layout
from dreamdrive.data.world import draw_street
from dreamdrive.errors import InputError
from dreamdrive.scene.layout import Area, Box, Ego, Layout, TrackPoint

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
    with pytest.raises(InputError, match="is no JSON"):
        read_layout(path)
    with pytest.raises(InputError, match="expected a layout as JSON"):
        read_layout(tmp_path / "none.json")


def test_the_published_schema_is_the_one_that_is_checked() -> None:
    assert (ROOT / "docs" / "layout.schema.json").read_text() == schema_text()


def test_the_drawing_shows_the_boxes_where_they_are() -> None:
    picture = draw_layout(small(), 2.0)
    empty = draw_layout(Layout(small().ego, areas=small().areas), 2.0)
    assert picture.shape == empty.shape
    rows, columns = np.nonzero((picture != empty).any(axis=-1))
    assert 0 < len(rows) < 0.05 * picture[..., 0].size
    scale = picture.shape[1] / np.ptp([p[0] for p in ((-38, 0), (82, 0))])
    assert columns.max() - columns.min() > 4 * scale
