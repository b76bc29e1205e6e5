import numpy as np
from hypothesis import given, strategies as st
from scipy.spatial import Delaunay

from dreamdrive.decompose.on_road import on_road


def test_a_shadow_is_road_and_a_low_pane_within_the_car_is_not():
    square = [(0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0)]
    pixels = np.array([*square, (5.0, 3.0), (5.0, 8.0), (-4.0, 5.0)])
    low = np.array([False] * 4 + [True] * 3)
    one = np.zeros(len(pixels), dtype=int)
    assert on_road(pixels, one, one, low).tolist() == [False] * 5 + [True] * 2


def test_the_outline_is_that_of_the_own_cluster_in_the_own_frame():
    square = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0)])
    inside = np.repeat([(5.0, 3.0)], 3, axis=0)
    pixels, low = np.concatenate([square, inside]), np.arange(7) >= 4
    frames, labels = np.array([2, 2, 2, 2, 2, 3, 2]), np.array([5, 5, 5, 5, 5, 5, 0])
    assert on_road(pixels, frames, labels, low).tolist() == [False] * 5 + [True] * 2


def test_fewer_than_three_high_points_have_no_outline():
    pixels = np.array([(0.0, 0.0), (10.0, 0.0), (5.0, 0.0)])
    one = np.zeros(3, dtype=int)
    assert on_road(pixels, one, one, np.array([False, False, True])).tolist() == [False, False, True]
    assert not on_road(pixels[:0], one[:0], one[:0], np.zeros(0, dtype=bool)).size


@given(st.integers(0, 2**32 - 1), st.integers(3, 30))
def test_the_outline_is_the_convex_hull(seed: int, count: int) -> None:
    generator = np.random.default_rng(seed)
    high, low = generator.uniform(0, 100, (count, 2)), generator.uniform(0, 100, (40, 2))
    pixels = np.concatenate([high, low])
    is_low = np.arange(len(pixels)) >= count
    one = np.zeros(len(pixels), dtype=int)
    within = Delaunay(high).find_simplex(low) >= 0
    assert (on_road(pixels, one, one, is_low)[count:] == ~within).mean() > 0.95
