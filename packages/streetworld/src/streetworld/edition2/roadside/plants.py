"""Trees, bushes and hedges of many sorts, their crowns of many small facets."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.street.layout import Barrier, Prop
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.roads.tiles import between
from streetworld.edition2.roadside.paints import Paints
from streetworld.engine import paint
from streetworld.engine.mesh import Mesh, cylinder

_CUT_SHARE = 0.55
_SORTS = ("broad", "round", "conifer", "column", "palm", "bare", "weeping")
_SHARES = (0.36, 0.18, 0.13, 0.08, 0.07, 0.13, 0.05)


def tree(prop: Prop, paints: Paints, snow: float, detail: float = 1.0) -> Mesh:
    """A tree with its foot at the origin; ``detail`` is the share of its facets that are drawn."""
    rng = np.random.default_rng([prop.look, 74])
    sort = str(rng.choice(_SORTS, p=_SHARES))
    if snow > 0.3 and sort != "conifer":
        sort = "bare"
    return _BUILD[sort](rng, prop.height_m, prop.look, paints, detail)


def bush(prop: Prop, paints: Paints, snow: float, detail: float = 1.0) -> Mesh:
    """A shrub."""
    del snow
    rng = np.random.default_rng([prop.look, 75])
    high, leaves = prop.height_m, _leaves(rng, prop.look, paints)
    wide = high * rng.uniform(0.5, 1.2)
    centres = rng.uniform((-0.5, -0.5, 0.3), (0.5, 0.5, 0.65), (int(rng.integers(3, 7)), 3)) * [
        wide,
        wide,
        high,
    ]
    return Mesh.joined(
        [
            _clump(rng, c, (0.5 * wide, 0.5 * wide, 0.4 * high), 130, 0.16 * high, leaves, detail)
            for c in centres
        ]
    )


def hedge(barrier: Barrier, paints: Paints) -> Mesh:
    """A cut or an overgrown hedge along a line: a dark core and facets on it."""
    rng = np.random.default_rng([barrier.look, 76])
    leaves, high, thick = _leaves(rng, barrier.look, paints), barrier.height_m, rng.uniform(0.5, 1.1)
    parts: list[Mesh] = []
    points = np.array(barrier.points)
    wild = rng.uniform(0.04, 0.2)
    for here, there in pairwise(points):
        length = float(np.linalg.norm(there - here))
        along = (there - here) / max(length, 1e-6)
        aside = np.array([-along[1], along[0]])
        count = int(np.clip(length * (high + thick) * 45, 12, 3000))
        s, t, z = (
            rng.uniform(0, length, count),
            rng.uniform(-0.5, 0.5, count) * thick,
            rng.uniform(0.05, 1, count) * high,
        )
        which = rng.integers(0, 3, count)
        t = np.where(which == 0, 0.5 * thick, np.where(which == 1, -0.5 * thick, t))
        z = np.where(which == 2, high, z)
        place = here + s[:, None] * along + t[:, None] * aside
        centre = np.column_stack([place, z]) + rng.normal(0, wild, (count, 3))
        parts.append(_facets(rng, centre, rng.uniform(0.06, 0.2, count), leaves))
        core = 0.42 * thick * aside
        low, top = 0.02, high - 0.1
        for side in (1, -1):
            a, b = (here + side * core, there + side * core)
            quad = np.array([[[*a, low], [*b, low], [*b, top], [*a, top]]])
            uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]]) * [max(1.0, length / 2), 1]
            pick = np.array([[0, 1, 2], [0, 2, 3]])
            parts.append(Mesh(quad[:, pick].reshape(-1, 3, 3), uv[pick], np.full(2, leaves)))
    return Mesh.joined(parts)


def _leaves(rng: np.random.Generator, look: int, paints: Paints) -> int:
    """A material of foliage: cut, or painted from dark green to autumn."""
    cut = paints.cut("vegetation", look, rng, _CUT_SHARE)
    if cut is not None:
        return paints.get(("leaves", look), Semantic.VEGETATION, lambda: cut[0])
    season = rng.random()
    if season < 0.75:
        colour = between(rng, (38, 58, 20), (112, 132, 62))
    elif season < 0.9:
        colour = between(rng, (120, 90, 30), (196, 150, 60))
    else:
        colour = between(rng, (90, 40, 30), (150, 80, 60))
    local = np.random.default_rng([look, 77])
    return paints.get(
        ("painted leaves", look),
        Semantic.VEGETATION,
        lambda: paint.leaves(local, (float(colour[0]), float(colour[1]), float(colour[2]))),
    )


def _bark(rng: np.random.Generator, paints: Paints) -> int:
    shade = int(rng.integers(4))

    def make() -> paint.Image:
        tint = np.array([[1, 1, 1], [0.6, 0.6, 0.6], [1.3, 1.25, 1.2], [0.8, 0.7, 0.6]])[shade]
        return paint.finished(paint.bark(np.random.default_rng(7)) * tint)

    return paints.get(("bark", shade), Semantic.VEGETATION, make)


def _facets(
    rng: np.random.Generator,
    centre: Float[np.ndarray, "n 3"],
    size: Float[np.ndarray, " n"],
    material: int,
    outward: Float[np.ndarray, "n 3"] | None = None,
) -> Mesh:
    """Small triangles of random directions about some places, leaning outward."""
    count = len(centre)
    normal = rng.standard_normal((count, 3))
    if outward is not None:
        normal = normal + 1.3 * outward
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-9
    across = np.cross(normal, rng.standard_normal((count, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True) + 1e-9
    other = np.cross(normal, across)
    turn = rng.uniform(0, 2 * np.pi, (count, 1)) + np.array([0, 2.1, 4.2]) + rng.normal(0, 0.3, (count, 3))
    reach = rng.uniform(0.6, 1.5, (count, 3)) * size[:, None]
    out = np.cos(turn)[..., None] * across[:, None] + np.sin(turn)[..., None] * other[:, None]
    corners = centre[:, None] + reach[..., None] * out
    uv = rng.uniform(0, 1, (count, 1, 2)) + np.array([[0, 0], [0.2, 0.05], [0.08, 0.2]])
    return Mesh(corners, uv, np.full(count, material))


def _clump(
    rng: np.random.Generator,
    centre: object,
    radii: object,
    count: int,
    size: float,
    material: int,
    detail: float,
) -> Mesh:
    """A cloud of facets near the surface of an ellipsoid; with less detail fewer and larger ones."""
    count, size = max(12, round(detail * count)), size / np.sqrt(detail)
    way = rng.standard_normal((count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    away = rng.uniform(0.55, 1.05, (count, 1)) ** 0.7
    place = np.asarray(centre) + way * away * np.asarray(radii)
    return _facets(rng, place, rng.uniform(0.6, 1.3, count) * size, material, way)


def _trunk(rng: np.random.Generator, top: float, radius: float, paints: Paints) -> tuple[Mesh, int]:
    bark = _bark(rng, paints)
    lean = rng.normal(0, 0.03, 2) * top
    return cylinder((0, 0, -0.2), (*lean, top), (radius, 0.5 * radius), bark, None, 7), bark


def _broad(rng: np.random.Generator, height: float, look: int, paints: Paints, detail: float) -> Mesh:
    """A crown of several clumps on branches."""
    leaves = _leaves(rng, look, paints)
    bare = rng.uniform(0.18, 0.42)
    trunk, bark = _trunk(rng, 0.6 * height, height * rng.uniform(0.016, 0.035), paints)
    parts, wide = [trunk], height * rng.uniform(0.2, 0.36)
    count = int(rng.integers(5, 10))
    for k in range(count):
        turn, away = 2 * np.pi * (k + rng.random()) / count, wide * rng.uniform(0.1, 0.8)
        z = height * rng.uniform(bare + 0.15, 0.88)
        centre = np.array([away * np.cos(turn), away * np.sin(turn), z])
        radius = wide * rng.uniform(0.35, 0.65)
        size = rng.uniform(0.04, 0.075) * height**0.7
        parts.append(_clump(rng, centre, (radius, radius, 0.75 * radius), 150, size, leaves, detail))
        start = (0, 0, height * rng.uniform(0.5 * bare, 0.5))
        parts.append(cylinder(start, centre.tolist(), (0.012 * height, 0.004 * height), bark, None, 4))
    return Mesh.joined(parts)


def _round(rng: np.random.Generator, height: float, look: int, paints: Paints, detail: float) -> Mesh:
    """A clipped or young tree: one ball on a stem."""
    leaves, radius = _leaves(rng, look, paints), height * rng.uniform(0.18, 0.3)
    trunk, _ = _trunk(rng, 0.6 * height, height * 0.015, paints)
    radii = (radius, radius, radius * rng.uniform(0.8, 1.4))
    centre = (0, 0, height - radii[2])
    return Mesh.joined([trunk, _clump(rng, centre, radii, 620, 0.17 * radius, leaves, detail)])


def _conifer(rng: np.random.Generator, height: float, look: int, paints: Paints, detail: float) -> Mesh:
    """Whorls of drooping branches, narrower towards the top."""
    leaves, wide = _leaves(rng, look, paints), height * rng.uniform(0.12, 0.24)
    trunk, _ = _trunk(rng, 0.9 * height, height * 0.018, paints)
    count = max(60, round(900 * detail))
    rise = rng.uniform(0.1, 1, count) ** 1.2
    turn, share = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(0.2, 1, count))
    radius = wide * (1 - rise) * share * (1 + 0.25 * np.sin(rise * 60))
    z = height * (0.1 + 0.9 * rise) - 0.25 * radius
    way = np.column_stack([np.cos(turn), np.sin(turn), np.full(count, 0.3)])
    centre = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), z])
    return Mesh.joined(
        [
            trunk,
            _facets(rng, centre, (0.2 + 0.8 * (1 - rise)) * 0.042 * height / np.sqrt(detail), leaves, way),
        ]
    )


def _column(rng: np.random.Generator, height: float, look: int, paints: Paints, detail: float) -> Mesh:
    """A cypress or poplar."""
    leaves, wide = _leaves(rng, look, paints), height * rng.uniform(0.07, 0.13)
    trunk, _ = _trunk(rng, 0.5 * height, height * 0.015, paints)
    return Mesh.joined(
        [
            trunk,
            _clump(
                rng, (0, 0, 0.55 * height), (wide, wide, 0.47 * height), 700, 0.027 * height, leaves, detail
            ),
        ]
    )


def _palm(rng: np.random.Generator, height: float, look: int, paints: Paints, detail: float) -> Mesh:
    """A bare stem with fronds that hang."""
    leaves = _leaves(rng, look, paints)
    trunk, _ = _trunk(rng, height, 0.02 * height, paints)
    parts = [trunk]
    reach = rng.uniform(1.6, 2.8)
    for turn in np.linspace(0, 2 * np.pi, int(rng.integers(12, 20))) + rng.uniform(0, 1):
        s = np.linspace(0, 1, 6)
        rise, droop = rng.uniform(0.1, 0.9), rng.uniform(0.8, 1.8)
        x, z = reach * s, height + reach * (rise * s - droop * s**2)
        half = 0.28 * reach * np.sin(np.pi * np.clip(s + 0.12, 0, 1)) ** 0.5 * 0.6
        line = np.stack([x * np.cos(turn), x * np.sin(turn), z], -1)
        aside = np.array([-np.sin(turn), np.cos(turn), -0.35])
        for k in range(5):
            for side in (1, -1):
                low, top = line[k], line[k + 1]
                a, b = (
                    low + side * half[k] * aside * [1, 1, side],
                    top + side * half[k + 1] * aside * [1, 1, side],
                )
                corners = np.array([[low, a, b], [low, b, top]])
                uv = np.array([[[0, 0], [0.3, 0], [0.3, 0.3]], [[0, 0], [0.3, 0.3], [0, 0.3]]]) + 0.1 * k
                parts.append(Mesh(corners, uv, np.full(2, leaves)))
    return Mesh.joined(parts)


def _bare(rng: np.random.Generator, height: float, look: int, paints: Paints, detail: float) -> Mesh:
    """Branches without leaves, as three-sided bars that fork."""
    del look
    levels = 5 if detail > 0.5 else 4 if detail > 0.2 else 3
    bark = _bark(rng, paints)
    starts, ends, radii = [], [], []
    tips = [(np.array([0.0, 0, -0.2]), np.array([0, 0, 1.0]), 0.3 * height, 0.02 * height)]
    for level in range(levels):
        grown: list[tuple[np.ndarray, np.ndarray, float, float]] = []
        for at, way, length, radius in tips:
            end = at + way * length
            starts.append(at)
            ends.append(end)
            radii.append((radius, 0.7 * radius))
            for _ in range(3 if level < 2 else int(rng.integers(2, 4))):
                turn = way + rng.normal(0, 0.55, 3) + [0, 0, 0.12]
                turn /= np.linalg.norm(turn)
                from_ = at + way * length * rng.uniform(0.65, 1)
                grown.append((from_, turn, length * rng.uniform(0.5, 0.85), 0.6 * radius))
        tips = grown
    return bars(np.array(starts), np.array(ends), np.array(radii), bark)


def bars(
    starts: Float[np.ndarray, "n 3"],
    ends: Float[np.ndarray, "n 3"],
    radii: Float[np.ndarray, "n 2"],
    material: int,
) -> Mesh:
    """Three-sided bars between points, with their radii at both ends."""
    axis = ends - starts
    axis /= np.linalg.norm(axis, axis=1, keepdims=True) + 1e-9
    across = np.cross(axis, [0.31, 0.87, 0.38])
    across /= np.linalg.norm(across, axis=1, keepdims=True) + 1e-9
    other = np.cross(axis, across)
    turn = np.arange(4) * 2 * np.pi / 3
    ring = np.cos(turn)[None, :, None] * across[:, None] + np.sin(turn)[None, :, None] * other[:, None]
    low, high = starts[:, None] + radii[:, :1, None] * ring, ends[:, None] + radii[:, 1:, None] * ring
    quads = np.stack([low[:, :-1], low[:, 1:], high[:, 1:], high[:, :-1]], axis=2).reshape(-1, 4, 3)
    pick = np.array([[0, 1, 2], [0, 2, 3]])
    uv = np.tile(np.array([[0, 1], [0.3, 1], [0.3, 0], [0, 0.0]]), (len(quads), 1, 1))
    return Mesh(
        quads[:, pick].reshape(-1, 3, 3), uv[:, pick].reshape(-1, 3, 2), np.full(2 * len(quads), material)
    )


def _weeping(rng: np.random.Generator, height: float, look: int, paints: Paints, detail: float) -> Mesh:
    """Leaves that hang in curtains."""
    leaves, wide = _leaves(rng, look, paints), height * rng.uniform(0.25, 0.36)
    trunk, _ = _trunk(rng, 0.7 * height, 0.03 * height, paints)
    count = max(60, round(900 * detail))
    turn, share = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(0.05, 1, count))
    top = height * (1 - 0.35 * share**2)
    z = top - rng.uniform(0, 0.55, count) * height * share
    centre = np.column_stack([wide * share * np.cos(turn), wide * share * np.sin(turn), np.maximum(z, 0.6)])
    way = np.column_stack([np.cos(turn), np.sin(turn), np.full(count, 0.2)])
    return Mesh.joined(
        [trunk, _facets(rng, centre, np.full(count, 0.032 * height / np.sqrt(detail)), leaves, way)]
    )


_BUILD: dict[str, Callable[[np.random.Generator, float, int, Paints, float], Mesh]] = {
    "broad": _broad,
    "round": _round,
    "conifer": _conifer,
    "column": _column,
    "palm": _palm,
    "bare": _bare,
    "weeping": _weeping,
}
