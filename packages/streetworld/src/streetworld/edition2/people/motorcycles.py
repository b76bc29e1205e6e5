"""Scooters and motorcycles, with riders or parked without."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dreamdrive.scene.level import pitched
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.layouts.variants import Draw
from streetworld.edition2.people.bicycles import guard, spokes
from streetworld.edition2.people.figure import dress
from streetworld.edition2.people.rider import Seat, has_rider, rider
from streetworld.edition2.vehicles.parts.body_materials import Coats
from streetworld.edition2.vehicles.parts.loft import bar, egg, ring_wheel, tube
from streetworld.edition2.vehicles.parts.wheels import rolling
from streetworld.engine.bodies import Part, Size
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh, box, cylinder

_FAMILIES = ("scooter", "scooter", "naked", "sport", "tourer", "moped", "cruiser")
"""By their shares; the last is that of looks kept out."""
_RIDDEN_M = {"sport": 1.42, "cruiser": 1.5}
_RADIUS_M = {"scooter": 0.25, "moped": 0.3}
_GRIP_M = 1.0
_PARKED_M = 1.15


def motorcycle_size(look: int) -> Size:
    """Length, width and height of a look, with its rider if it has one."""
    draw = Draw("motorcycle", look)
    family, rng = draw.option(_FAMILIES), draw.rng
    length = float(rng.uniform(1.75, 1.95) if family in _RADIUS_M else rng.uniform(2.0, 2.25))
    width = float(rng.uniform(0.7, 0.85))
    ridden = _RIDDEN_M.get(family, 1.56) + float(rng.uniform(0, 0.2))
    return length, width, ridden if has_rider(look) else _PARKED_M


@dataclass(frozen=True)
class _Machine:
    """Where the parts of a motorcycle are, along x and z, and its materials."""

    family: str
    back: float
    front: float
    radius: float
    saddle: tuple[float, float]
    grip_x: float
    body: int
    dark: int
    steel: int


def motorcycle(size_m: Size, look: int, materials: Materials) -> list[Part]:
    """A scooter or a motorcycle, perhaps with its rider."""
    draw = Draw("motorcycle", look)
    family = draw.option(_FAMILIES)
    length, width, top = size_m
    coats = Coats(draw, Semantic.MOTORCYCLE, materials)
    radius = _RADIUS_M.get(family, 0.32)
    front, back = 0.5 * length - radius, radius - 0.5 * length
    machine = _Machine(
        family,
        back,
        front,
        radius,
        saddle=(back + 0.4 * (front - back), 0.68 if family == "cruiser" else 0.76),
        grip_x=front - 0.24,
        body=coats.plain(draw.paint(), 0.05),
        dark=coats.plain((26, 26, 28)),
        steel=coats.plain(draw.any_of(((150, 152, 156), (70, 72, 76))), 0.1),
    )
    shell = _scooter if family in _RADIUS_M else _motor
    parts = [Part(Mesh.joined([*shell(draw, machine), *_fittings(draw, machine, size_m, coats)]))]
    wheel = _wheel(machine)
    parts += [Part(wheel, rolling((x, 0.0, radius), radius)) for x in (back, front)]
    if has_rider(look):
        x, z = machine.saddle
        lean = {"sport": 0.6, "naked": 0.25}.get(family, 0.08)
        step = (x + (0.42 if family in (*_RADIUS_M, "cruiser") else 0.08), 0.32)
        seat = Seat((x, z), (machine.grip_x - 0.02, _GRIP_M), step, 0.45 * width - 0.05, lean)
        colour = draw.bright() if draw.chance(0.5) else draw.any_of(((24, 24, 26), (230, 230, 228)))
        parts += rider(draw, seat, top, dress(draw, coats, False), coats.plain(colour, 0.05))
    return parts


def _wheel(machine: _Machine) -> Mesh:
    radius, dark, steel = machine.radius, machine.dark, machine.steel
    disc = cylinder((0, -0.03, 0), (0, 0.03, 0), (0.3 * radius, 0.3 * radius), steel, steel, 10)
    tyre = ring_wheel(radius, 0.13, dark, 18)
    return Mesh.joined([tyre, disc, *spokes(6, 0.8 * radius, 0.02, steel)])


def _fittings(draw: Draw, machine: _Machine, size_m: Size, coats: Coats) -> list[Mesh]:
    """Bar, fork, mirrors, lamps, plate and front mudguard."""
    length, width, top = size_m
    half, x, z = 0.5 * length, machine.grip_x, _GRIP_M
    dark, steel, front, radius = machine.dark, machine.steel, machine.front, machine.radius
    made = [bar((x, -0.45 * width, z), (x, 0.45 * width, z), (0.018, 0.018), dark)]
    for side in (-1, 1):
        made.append(
            bar((front, side * 0.08, radius), (x + 0.03, side * 0.08, 0.9 * z), (0.026, 0.026), steel)
        )
        mirror = (x - 0.02, side * 0.42 * width, min(z + 0.15, top - 0.05))
        made.append(bar((x, side * 0.32 * width, z), mirror, (0.008, 0.008), dark))
        made.append(box(mirror, (0.02, 0.12, 0.08), dark))
    lamp = coats.plain((255, 252, 240) if draw.chance(0.7) else (214, 218, 222))
    red = coats.plain((255, 50, 40) if draw.chance(0.3) else (164, 20, 22))
    made.append(egg((x + 0.16, 0, 0.86), (0.06, 0.085, 0.085), lamp))
    made.append(box((-half + 0.16, 0, 0.72), (0.05, 0.16, 0.07), red))
    made.append(box((-half + 0.1, 0, 0.56), (0.02, 0.2, 0.16), coats.plain((232, 232, 228))))
    return [*made, *guard(front, radius, radius + 0.04, machine.body)]


def _lying(rows: Sequence[tuple[float, float, float, float]], material: int) -> Mesh:
    """A body along x: rows of place, half width, lower and upper edge."""
    place, half, low, high = np.array(rows).T
    centres = np.stack([-0.5 * (low + high), 0 * place, place], axis=-1)
    upright = tube(centres, np.stack([0.5 * (high - low), half], axis=-1), material, 10, 2.6)
    return upright.moved(pitched((0, 0, 0), np.pi / 2))


def _motor(draw: Draw, machine: _Machine) -> list[Mesh]:
    """Tank, seat, engine, fairing and exhaust."""
    back, dark, steel = machine.back, machine.dark, machine.steel
    (x, z), grip = machine.saddle, machine.grip_x
    tank = [
        (x + 0.1, 0, z, z + 0.1),
        (x + 0.14, 0.09, z - 0.05, z + 0.12),
        (x + 0.35, 0.14, z, z + 0.22),
        (grip - 0.05, 0.1, z + 0.02, z + 0.18),
        (grip, 0, z + 0.1, z + 0.12),
    ]
    seat = [
        (back - 0.1, 0, z + 0.08, z + 0.1),
        (back, 0.08, z, z + 0.12),
        (x, 0.13, z - 0.06, z + 0.03),
        (x + 0.2, 0.1, z - 0.04, z + 0.04),
        (x + 0.22, 0, z, z),
    ]
    engine = [
        (x - 0.1, 0, 0.4, 0.6),
        (x - 0.05, 0.16, 0.26, 0.66),
        (x + 0.42, 0.17, 0.24, 0.7),
        (x + 0.5, 0, 0.4, 0.6),
    ]
    fairing = [
        (grip - 0.2, 0, 0.6, 0.8),
        (grip - 0.17, 0.15, 0.42, 0.96),
        (grip - 0.02, 0.19, 0.38, 1.06),
        (grip + 0.16, 0.15, 0.52, 1.02),
        (grip + 0.24, 0.08, 0.62, 0.9),
        (grip + 0.27, 0, 0.72, 0.8),
    ]
    made = [
        _lying(tank, machine.body),
        _lying(seat, dark),
        _lying(engine, steel if draw.chance(0.4) else dark),
        cylinder((x + 0.2, -0.15, 0.28), (back - 0.15, -0.19, 0.42), (0.035, 0.06), steel, steel, 8),
        bar((back, 0, machine.radius), (x + 0.1, 0, 0.45), (0.05, 0.06), dark),
    ]
    if machine.family in ("sport", "tourer"):
        made.append(_lying(fairing, machine.body))
    if machine.family in ("tourer", "cruiser") and draw.chance(0.7):
        case = draw.any_of((machine.body, dark))
        made += [box((back, y, 0.66), (0.44, 0.2, 0.32), case) for y in (-0.26, 0.26)]
    return made


def _scooter(draw: Draw, machine: _Machine) -> list[Mesh]:
    """Shield, floor, seat and tail."""
    back, body, dark, steel = machine.back, machine.body, machine.dark, machine.steel
    (x, z), shield = machine.saddle, machine.grip_x + 0.02
    tail = [
        (back - 0.22, 0, 0.6, 0.66),
        (back - 0.1, 0.14, 0.42, 0.74),
        (x, 0.18, 0.3, 0.72),
        (x + 0.18, 0.13, 0.26, 0.68),
        (x + 0.2, 0, 0.3, 0.6),
    ]
    seat = [
        (back - 0.2, 0, z, z + 0.02),
        (back - 0.1, 0.13, z - 0.04, z + 0.06),
        (x + 0.15, 0.12, z - 0.06, z + 0.02),
        (x + 0.2, 0, z - 0.03, z),
    ]
    front = [
        (shield - 0.1, 0, 0.3, 0.5),
        (shield - 0.06, 0.19, 0.26, 0.86),
        (shield + 0.06, 0.16, 0.3, 0.96),
        (shield + 0.14, 0, 0.5, 0.9),
    ]
    made = [
        _lying(tail, body),
        _lying(seat, dark),
        box((0.5 * (x + 0.1 + shield), 0, 0.27), (shield - x + 0.1, 0.32, 0.08), dark),
        cylinder((back + 0.1, -0.14, 0.27), (back - 0.22, -0.16, 0.32), (0.04, 0.05), steel, steel, 8),
    ]
    if machine.family == "scooter":
        made.append(_lying(front, body))
    if draw.chance(0.3):
        made.append(box((back - 0.1, 0, z + 0.24), (0.42, 0.42, 0.36), draw.any_of((body, dark))))
    return made
