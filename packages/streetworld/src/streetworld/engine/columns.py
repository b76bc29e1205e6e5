"""Many small vectors as a table (N, k) whose columns lie one after another in memory.

NumPy's inner loops then run over N entries and not over the k of a row, which makes arithmetic of a column
with a table several times faster. Every function takes tables of either order and returns such a table.
"""

import numpy as np
from jaxtyping import Float, Int, Shaped


def by_columns(columns: list[np.ndarray]) -> Shaped[np.ndarray, "n k"]:
    """The table of some columns (N,)."""
    return np.stack(columns).T


def picked(table: Shaped[np.ndarray, "m *k"], index: Int[np.ndarray, " n"]) -> Shaped[np.ndarray, "n *k"]:
    """Some rows of a table."""
    return np.take(table.T, index, axis=-1).T


def outer(factors: Float[np.ndarray, " n"], vector: Float[np.ndarray, " k"]) -> Float[np.ndarray, "n k"]:
    """One vector times many factors."""
    return np.multiply.outer(vector, factors).T


def dot(a: Float[np.ndarray, "n k"], b: Float[np.ndarray, "#n k"]) -> Float[np.ndarray, " n"]:
    """Scalar products (N,) of rows; the second table may have a single one."""
    total = a[:, 0] * b[:, 0]
    for k in range(1, a.shape[1]):
        total += a[:, k] * b[:, k]
    return total


def turned(vectors: Float[np.ndarray, "n k"], rotation: Float[np.ndarray, "j k"]) -> Float[np.ndarray, "n j"]:
    """Rows times a small matrix. A matrix library would wake all its threads for it, who then spin."""
    return by_columns([dot(vectors, row[None]) for row in rotation])
