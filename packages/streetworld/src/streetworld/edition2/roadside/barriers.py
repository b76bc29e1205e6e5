"""Fences, walls and guard rails along lines."""

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.street.layout import Barrier
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.roads.tiles import between
from streetworld.edition2.roadside.paints import Paints
from streetworld.edition2.roadside.plants import hedge
from streetworld.engine import paint
from streetworld.engine.mesh import Mesh, quads

_MOST_BARS = 700


def barrier(given: Barrier, paints: Paints) -> Mesh:
    """A barrier on the map."""
    return {"fence": _fence, "hedge": hedge, "wall": _wall, "rail": _rail}[given.kind](given, paints)


class _Path:
    """A line of the map by the way along it."""

    def __init__(self, points: list[tuple[float, float]]) -> None:
        self.points = np.array(points, dtype=np.float64)
        self.way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1))])

    @property
    def length(self) -> float:
        return float(self.way[-1])

    def at(self, way_m: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
        """Places along it."""
        return np.stack([np.interp(way_m, self.way, self.points[:, k]) for k in (0, 1)], -1)

    def aside(self, way_m: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
        """Unit vectors to the left."""
        step = self.at(np.minimum(way_m + 0.2, self.length)) - self.at(np.maximum(way_m - 0.2, 0))
        step /= np.linalg.norm(step, axis=1, keepdims=True) + 1e-9
        return np.stack([-step[:, 1], step[:, 0]], -1)


def _strip(
    path: _Path,
    knots: np.ndarray,
    left_m: tuple[float, float],
    z_m: tuple[float, float],
    material: int,
    texture_m: float,
) -> Mesh:
    """A band along the path between two distances to the left and two heights."""
    place, aside = path.at(knots), path.aside(knots)
    low = np.column_stack([place + left_m[0] * aside, np.full(len(knots), z_m[0])])
    top = np.column_stack([place + left_m[1] * aside, np.full(len(knots), z_m[1])])
    corners = np.stack([low[:-1], low[1:], top[1:], top[:-1]], axis=1)
    mesh = quads(corners, material)
    u = knots / texture_m
    pick = np.array([[0, 1, 2], [0, 2, 3]])
    uv = np.stack(
        [np.stack([u[:-1], u[1:], u[1:], u[:-1]], -1), np.tile([1.0, 1, 0, 0], (len(u) - 1, 1))], -1
    )
    return Mesh(mesh.corners, uv[:, pick].reshape(-1, 3, 2), mesh.material)


def _knots(path: _Path) -> np.ndarray:
    return np.unique(np.concatenate([path.way, np.linspace(0, path.length, max(2, int(path.length / 8)))]))


def _posts(path: _Path, ways: np.ndarray, wide: float, z_m: tuple[float, float], material: int) -> Mesh:
    """Upright bars with four sides at some places along the path."""
    place, aside = path.at(ways), path.aside(ways)
    along = np.stack([aside[:, 1], -aside[:, 0]], -1)
    half = 0.5 * wide
    ring = [place + half * (s * along + t * aside) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    faces = []
    for k in range(4):
        a, b = ring[k], ring[(k + 1) % 4]
        low, top = (np.full((len(ways), 1), z) for z in z_m)
        faces.append(
            np.stack([np.hstack([a, low]), np.hstack([b, low]), np.hstack([b, top]), np.hstack([a, top])], 1)
        )
    cap = np.stack([np.hstack([r, np.full((len(ways), 1), z_m[1])]) for r in ring], 1)
    return quads(np.concatenate([*faces, cap]), material)


def _fence(given: Barrier, paints: Paints) -> Mesh:
    """Pickets, rails, bars of iron, boards, or posts with wire."""
    rng, path, high = np.random.default_rng([given.look, 91]), _Path(given.points), given.height_m
    colours = [
        (236, 236, 230),
        (120, 92, 66),
        (60, 46, 36),
        (40, 42, 44),
        (140, 142, 142),
        (52, 78, 60),
        (168, 140, 108),
    ]
    paint_ = paints.plain(("fence",), Semantic.WALL, colours[int(rng.integers(len(colours)))])
    knots, sort = _knots(path), str(rng.choice(["picket", "rails", "iron", "boards", "wire"]))
    gap = rng.uniform(1.8, 3.0)
    posts = _posts(path, np.arange(0, path.length, gap), 0.09, (0, high), paint_)
    parts = [posts]
    if sort == "boards":
        parts += [_strip(path, knots, (0, 0), (0.05, high), _boards(given.look, paints), 2.0)]
        return Mesh.joined(parts)
    levels = {
        "picket": (0.25, 0.8),
        "rails": (0.35, 0.65, 0.95),
        "iron": (0.1, 0.95),
        "wire": (0.05, 0.3, 0.55, 0.8, 0.98),
    }[sort]
    thick = {"picket": 0.08, "rails": 0.14, "iron": 0.04, "wire": 0.018}[sort]
    for level in levels:
        z = level * high
        parts += [
            _strip(path, knots, (side, side), (z - 0.5 * thick, z + 0.5 * thick), paint_, 2.0)
            for side in (0.02, -0.02)
        ]
    if sort in ("picket", "iron"):
        step = max(0.13 if sort == "iron" else 0.16, path.length / _MOST_BARS)
        wide = 0.025 if sort == "iron" else 0.09
        ways = np.arange(0, path.length, step)
        parts.append(_posts(path, ways, wide, (0.05, high), paint_))
    return Mesh.joined(parts)


def _boards(look: int, paints: Paints) -> int:
    def make() -> paint.Image:
        rng = np.random.default_rng([look, 92])
        colour = between(rng, (90, 66, 46), (200, 190, 176))
        image = np.repeat(colour + rng.normal(0, 10, (1, 20, 3)), 5, axis=1) + rng.normal(0, 4, (64, 100, 3))
        image[:, ::5] *= 0.6
        return paint.finished(image)

    return paints.get(("boards", look), Semantic.WALL, make)


def _wall(given: Barrier, paints: Paints) -> Mesh:
    """A wall of brick, plaster or stone, or a concrete barrier, with a coping."""
    rng, path, high = np.random.default_rng([given.look, 93]), _Path(given.points), given.height_m
    knots = _knots(path)
    cut = paints.cut("facade" if rng.random() < 0.3 else "clutter", given.look, rng, 0.35)

    def make() -> paint.Image:
        local = np.random.default_rng([given.look, 94])
        colour = (
            between(local, (96, 70, 56), (220, 210, 198))
            if local.random() < 0.6
            else np.full(3, local.uniform(120, 200))
        )
        image = paint.plain(local, 4.0, max(0.4, high), tuple(colour.tolist())).astype(np.float32)
        if local.random() < 0.6:
            course = int(local.integers(2, 9))
            image[::course] *= 0.8
            image[:, :: int(local.integers(5, 40))] *= 0.9
        return paint.finished(image)

    face = paints.get(("wall", given.look, round(high, 1)), Semantic.WALL, (lambda: cut[0]) if cut else make)
    width = cut[1] if cut else 4.0
    foot, top = (0.3, 0.1) if high < 1.2 else (rng.uniform(0.1, 0.25),) * 2
    coping = paints.plain(("coping",), Semantic.WALL, rng.uniform(90, 210) * np.ones(3))
    return Mesh.joined(
        [
            _strip(path, knots, (foot, top), (0, high), face, width),
            _strip(path, knots, (-foot, -top), (0, high), face, width),
            _strip(path, knots, (top, -top), (high, high + 0.001), coping, 2.0),
        ]
    )


def _rail(given: Barrier, paints: Paints) -> Mesh:
    """A guard rail: a folded band on posts, one or two of them."""
    rng, path, high = np.random.default_rng([given.look, 95]), _Path(given.points), given.height_m
    grey = rng.uniform(110, 190)
    steel = paints.plain(("rail",), Semantic.WALL, (grey, grey, grey * 1.02), 0.05)
    knots, parts = (
        _knots(path),
        [_posts(path, np.arange(0, path.length, rng.choice([1.33, 2.0, 4.0])), 0.1, (0, high), steel)],
    )
    for top in (high, 0.6 * high) if high > 0.95 else (high,):
        z = [top - 0.31, top - 0.23, top - 0.155, top - 0.08, top]
        out = [0.06, 0.11, 0.06, 0.11, 0.06]
        for side in (1, -1) if rng.random() < 0.3 else (1,):
            parts += [
                _strip(path, knots, (side * out[k], side * out[k + 1]), (z[k], z[k + 1]), steel, 4.0)
                for k in range(4)
            ]
    return Mesh.joined(parts)
