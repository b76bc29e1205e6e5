"""Rectangles against shapely's polygons."""

import numpy as np
import shapely
from hypothesis import given, strategies as st

from dreamdrive.tasks.plan import corners, inside, overlapping

boxes = st.lists(
    st.tuples(
        st.floats(-6, 6), st.floats(-6, 6), st.floats(0.3, 9), st.floats(0.3, 3), st.floats(-np.pi, np.pi)
    ),
    min_size=1,
    max_size=8,
).map(lambda rows: np.array(rows, np.float64))
GUARD_M = 1e-6


@given(boxes, boxes)
def test_overlaps_are_those_of_polygons(a: np.ndarray, b: np.ndarray) -> None:
    ours = overlapping(a[:, None], b[None])
    assert ours.shape == (len(a), len(b))
    for row, one in enumerate(map(shapely.Polygon, corners(a))):
        for column, other in enumerate(map(shapely.Polygon, corners(b))):
            if one.intersection(other).area > GUARD_M:
                assert ours[row, column]
            if one.distance(other) > GUARD_M:
                assert not ours[row, column]


@given(boxes, st.tuples(st.floats(-8, 8), st.floats(-8, 8)))
def test_points_inside_are_those_in_polygons(rectangles: np.ndarray, point: tuple[float, float]) -> None:
    ours = inside(np.broadcast_to(point, (len(rectangles), 2)), rectangles)
    for found, polygon in zip(ours, map(shapely.Polygon, corners(rectangles)), strict=True):
        if polygon.exterior.distance(shapely.Point(point)) > GUARD_M:
            assert found == polygon.contains(shapely.Point(point))


def test_corners_begin_ahead_on_the_left() -> None:
    made = corners(np.array([1.0, 2.0, 4.0, 2.0, np.pi / 2]))
    np.testing.assert_allclose(made, [[0, 4], [2, 4], [2, 0], [0, 0]], atol=1e-12)


def test_rectangles_that_touch_overlap() -> None:
    others = np.array([[2.0, 0, 2, 2, 0], [2.0 + 1e-9, 0, 2, 2, 0]])
    assert overlapping(np.array([0.0, 0, 2, 2, 0]), others).tolist() == [True, False]


def test_long_thin_ones_that_cross_overlap_without_a_corner_inside() -> None:
    a, b = np.array([[0.0, 0, 10, 0.5, 0.3]]), np.array([[0.0, 0, 10, 0.5, 1.9]])
    assert overlapping(a, b).all()
    assert not inside(corners(a)[0], b).any()
    assert not inside(corners(b)[0], a).any()
