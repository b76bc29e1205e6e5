"""One thing of a layout changes by the distance asked for, and nothing else does."""

import numpy as np
import pytest

from dreamdrive.data.layout_file import problems
from dreamdrive.scene.street.layout import is_moving
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_bench.control.layout_edits import move_box, widen_road
from streetworld import StreetOptions, draw_street, drive


@pytest.fixture(scope="module")
def street() -> DriveTruth:
    return drive(draw_street(3, StreetOptions(seconds=0.6)), 6, size=(64, 40))


@pytest.mark.parametrize("moving", [True, False])
def test_one_box_goes_two_metres(street: DriveTruth, moving: bool) -> None:
    before = street.world.layout
    edit = move_box(street, moving, 2.0)
    assert problems(edit.layout) == []
    changed = [(a, b) for a, b in zip(before.boxes, edit.layout.boxes, strict=True) if a != b]
    assert [a.id for a, _ in changed] == [edit.id]
    old, new = changed[0]
    assert is_moving(old.track) == moving
    for p, q in zip(old.track, new.track, strict=True):
        np.testing.assert_allclose([q.x_m - p.x_m, q.y_m - p.y_m], edit.moved_m, atol=1e-9)
        assert (p.t_s, p.yaw_rad) == (q.t_s, q.yaw_rad)
    assert np.linalg.norm(edit.moved_m) == pytest.approx(2)
    assert (edit.layout.areas, edit.layout.lines, edit.layout.ego) == (before.areas, before.lines, before.ego)


def test_one_edge_of_the_road_goes_out(street: DriveTruth) -> None:
    before = street.world.layout
    wide = widen_road(before, 0.5)
    assert problems(wide) == []

    def edges(layout) -> tuple[float, float]:
        road = np.array(next(a for a in layout.areas if a.kind == "road").polygon)
        return float(road[:, 1].min()), float(road[:, 1].max())

    assert edges(wide) == pytest.approx((edges(before)[0] - 0.5, edges(before)[1]))
    hole = next(a for a in wide.areas if a.kind == "sidewalk").holes[0]
    assert min(y for _, y in hole) == pytest.approx(edges(wide)[0], abs=0.02)
    assert wide.boxes == before.boxes
    with pytest.raises(SystemExit, match="not straight"):
        widen_road(draw_street(4), 0.5)
