"""Tables by columns hold what plain NumPy computes, and keep their layout."""

import numpy as np
from hypothesis import given, strategies as st

from streetworld.engine.columns import by_columns, dot, outer, picked, turned


@given(st.integers(0, 2**32 - 1), st.integers(0, 40), st.sampled_from([(3,), (2, 4)]))
def test_rows_are_picked_from_tables_of_any_shape(seed: int, count: int, shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(seed)
    table = np.asfortranarray(rng.normal(size=(9, *shape)))
    index = rng.integers(0, 9, count)
    found = picked(table, index)
    np.testing.assert_array_equal(found, table[index])
    assert found.flags.f_contiguous


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
def test_arithmetic_is_that_of_rows(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    a, b, rotation = rng.normal(size=(count, 3)), rng.normal(size=(count, 3)), rng.normal(size=(2, 3))
    np.testing.assert_allclose(dot(a, b), (a * b).sum(axis=1), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(dot(a, b[:1]), a @ b[0], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(turned(a, rotation), a @ rotation.T, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(outer(a[:, 0], rotation[0]), a[:, :1] * rotation[0])
    np.testing.assert_array_equal(by_columns([a[:, 1], b[:, 2]]), np.stack([a[:, 1], b[:, 2]], axis=-1))
    assert all(t.flags.f_contiguous for t in (turned(a, rotation), outer(a[:, 0], rotation[0])))
