"""Bicycles, with riders or parked without."""

import itertools
from dataclasses import dataclass

import numpy as np

from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.layouts.variants import Draw
from streetworld.edition2.people.figure import dress
from streetworld.edition2.people.rider import Seat, has_rider, rider
from streetworld.edition2.vehicles.parts.body_materials import Coats
from streetworld.edition2.vehicles.parts.loft import bar, ring_wheel
from streetworld.edition2.vehicles.parts.wheels import rolling
from streetworld.engine.bodies import Part, Size
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh, box, cylinder

_FAMILIES = ("city", "city", "trekking", "mountain", "racing", "child", "cargo", "folding")
"""By their shares; the last is that of looks kept out."""
_LEAN_RAD = {"racing": 0.75, "mountain": 0.5, "city": 0.15, "child": 0.25}
_BAR_M = {"racing": 0.95, "city": 1.12, "child": 0.78}


def bicycle_size(look: int) -> Size:
    """Length, width and height of a look, with its rider if it has one."""
    draw = Draw("bicycle", look)
    family, rng = draw.option(_FAMILIES), draw.rng
    length = float(rng.uniform(1.25, 1.5) if family in ("child", "folding") else rng.uniform(1.68, 1.85))
    length += 0.5 if family == "cargo" else 0.0
    width = float(rng.uniform(0.5, 0.65))
    if not has_rider(look):
        return length, width, 0.8 if family == "child" else 1.05
    return length, width, float(rng.uniform(1.25, 1.45) if family == "child" else rng.uniform(1.62, 1.85))


@dataclass(frozen=True)
class _Frame:
    """Where the parts of a bicycle are, along x and z."""

    family: str
    back: float
    front: float
    radius: float
    saddle: tuple[float, float]
    crank: tuple[float, float]
    grip: tuple[float, float]
    width: float


def _frame(family: str, size_m: Size, parked: bool) -> _Frame:
    radius = 0.25 if family in ("child", "folding") else 0.345
    front, back = 0.5 * size_m[0] - radius, radius - 0.5 * size_m[0]
    grip_z = _BAR_M.get(family, 1.04)
    return _Frame(
        family,
        back,
        front,
        radius,
        saddle=(back + 0.42 * (front - back), 0.74 if family == "child" else 0.94),
        crank=(back + 0.46 * (front - back), 0.29),
        grip=(front - (0.12 if family == "racing" else 0.26), min(grip_z, size_m[2]) if parked else grip_z),
        width=size_m[1],
    )


def bicycle(size_m: Size, look: int, materials: Materials) -> list[Part]:
    """A bicycle, perhaps with its rider."""
    draw = Draw("bicycle", look)
    family = draw.option(_FAMILIES)
    coats = Coats(draw, Semantic.BICYCLE, materials)
    frame = _frame(family, size_m, not has_rider(look))
    colour = draw.bright() if draw.chance(0.6) else draw.any_of(((26, 27, 30), (200, 200, 202)))
    dark, steel = coats.plain((26, 26, 28)), coats.plain((150, 152, 156), 0.1)
    made = [*_tubes(frame, coats.plain(colour, 0.04), dark), *_fittings(draw, frame, dark, coats)]
    parts = [Part(Mesh.joined(made))]
    wheel = _spoked(frame.radius, dark, steel)
    parts += [Part(wheel, rolling((x, 0.0, frame.radius), frame.radius)) for x in (frame.back, frame.front)]
    if has_rider(look):
        x, z = frame.grip
        lean, crank_m = _LEAN_RAD.get(family, 0.32), 0.12 if family == "child" else 0.16
        seat = Seat(frame.saddle, (x - 0.04, z), frame.crank, 0.42 * size_m[1], lean, crank_m)
        clothes = dress(draw, coats, family == "child")
        helmet = coats.plain(draw.bright()) if draw.chance(0.5) else None
        parts += rider(draw, seat, size_m[2], clothes, helmet)
    return parts


def _tubes(frame: _Frame, paint: int, dark: int) -> list[Mesh]:
    """Frame, fork, bar, saddle and crank."""
    back, front, radius = frame.back, frame.front, frame.radius
    x, z = frame.grip
    neck = (x + 0.06, 0.0, 0.8 * z)
    seat = (frame.saddle[0], 0.0, frame.saddle[1] - 0.1)
    low = (frame.crank[0], 0.0, frame.crank[1])
    stepped = frame.family in ("city", "folding", "child")
    middle = (seat[0] + 0.1, 0.0, 0.5 * seat[2]) if stepped else seat
    tubes = [
        (low, seat, 0.02, paint),
        (low, (neck[0], 0.0, neck[2] - 0.1), 0.024, paint),
        (middle, neck, 0.02, paint),
        (seat, (seat[0], 0.0, frame.saddle[1]), 0.014, dark),
        (neck, (x, 0.0, z), 0.014, dark),
        ((x, -0.45 * frame.width, z), (x, 0.45 * frame.width, z), 0.015, dark),
    ]
    for y in (-0.05, 0.05):
        tubes += [
            ((back, y, radius), (low[0], 0.4 * y, low[2]), 0.012, paint),
            ((back, y, radius), (seat[0], 0.4 * y, seat[2] - 0.05), 0.011, paint),
            ((front, y, radius), (neck[0], 0.5 * y, neck[2] - 0.1), 0.014, paint),
        ]
    saddle = box((frame.saddle[0] - 0.02, 0, frame.saddle[1]), (0.25, 0.12, 0.05), dark)
    chain = cylinder((low[0], -0.04, low[2]), (low[0], 0.04, low[2]), (0.09, 0.09), dark, dark, 10)
    return [*(bar(a, b, (r, r), m) for a, b, r, m in tubes), saddle, chain]


def _fittings(draw: Draw, frame: _Frame, dark: int, coats: Coats) -> list[Mesh]:
    """Mudguards, lamps, carrier, bags, box."""
    made = []
    (x, z), radius, back = frame.grip, frame.radius, frame.back
    if draw.chance(0.55):
        for axle in (back, frame.front):
            made += guard(axle, radius, radius + 0.03, dark)
        made.append(
            box((back - radius - 0.02, 0, 1.55 * radius), (0.04, 0.06, 0.06), coats.plain((190, 24, 26)))
        )
        made.append(box((x + 0.12, 0, z - 0.16), (0.06, 0.07, 0.07), coats.plain((226, 228, 230))))
    if frame.family in ("city", "trekking", "cargo") and draw.chance(0.6):
        made.append(box((back, 0, 0.76), (0.36, 0.14, 0.03), dark))
        if draw.chance(0.4):
            bag = coats.plain(draw.bright())
            made += [box((back, y, 0.58), (0.3, 0.12, 0.32), bag) for y in (-0.13, 0.13)]
    if frame.family == "cargo":
        made.append(box((frame.front - 0.5, 0, 0.52), (0.6, 0.48, 0.4), coats.plain(draw.bright())))
    return made


def guard(x: float, z: float, radius_m: float, material: int) -> list[Mesh]:
    """A mudguard over a wheel whose axle is there."""
    turn = np.linspace(0.1, np.pi - 0.1, 8)
    points = [(x + radius_m * np.cos(a), 0.0, z + radius_m * np.sin(a)) for a in turn]
    return [bar(a, b, (0.025, 0.025), material) for a, b in itertools.pairwise(points)]


def _spoked(radius: float, tyre: int, steel: int) -> Mesh:
    """A wheel that can be seen through."""
    hub = cylinder((0, -0.05, 0), (0, 0.05, 0), (0.03, 0.03), steel, steel, 6)
    return Mesh.joined([ring_wheel(radius, 0.045, tyre), hub, *spokes(9, 0.95 * radius, 0.005, steel)])


def spokes(count: int, length_m: float, radius_m: float, material: int) -> list[Mesh]:
    """Bars from the axle outwards."""
    tips = [(length_m * np.cos(a), 0.0, length_m * np.sin(a)) for a in np.arange(count) * 2 * np.pi / count]
    return [bar((0, 0, 0), tip, (radius_m, radius_m), material) for tip in tips]
