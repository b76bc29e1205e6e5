"""Bicycles, scooters and motorcycles, with riders or parked without."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dreamdrive.world import paint
from dreamdrive.world.bodies import Part, Size
from dreamdrive.world.edition2.draw import Colour, Draw
from dreamdrive.world.edition2.figure import Clothes, bent, dress, head, limb, trunk
from dreamdrive.world.edition2.loft import bar, egg, ring_wheel, tube
from dreamdrive.world.edition2.wheels import rolling
from dreamdrive.world.materials import Materials, Semantic
from dreamdrive.world.mesh import Mesh, box, cylinder, pitched

BICYCLES = ("city", "city", "trekking", "mountain", "racing", "child", "cargo", "folding")
MOTORCYCLES = ("scooter", "scooter", "naked", "sport", "tourer", "moped", "cruiser")
"""By their shares; the last of each are those of looks kept out."""


def has_rider(look: int) -> bool:
    """Whether somebody rides a bicycle or motorcycle of this look; the others stand parked."""
    return look // 5 % 2 == 0


@dataclass(frozen=True)
class _Seat:
    """Where a rider sits, holds on and steps, beside the middle, and how far he leans forward."""

    hip: tuple[float, float]
    hand: tuple[float, float]
    pedal: tuple[float, float]
    hand_wide: float
    lean_rad: float
    crank_m: float = 0.0


def two_wheeler_size(kind: str, look: int) -> Size:
    """Length, width and height of a bicycle's or a motorcycle's look."""
    draw = Draw("bicycle" if kind == "bicycle" else "motorcycle", look)
    rng = draw.rng
    if kind == "bicycle":
        family = draw.option(BICYCLES)
        small = family in ("child", "folding")
        length = float(rng.uniform(1.25, 1.5)) if small else float(rng.uniform(1.68, 1.85))
        length += 0.5 if family == "cargo" else 0.0
        rider = float(rng.uniform(1.25, 1.45)) if family == "child" else float(rng.uniform(1.62, 1.85))
        return (
            length,
            float(rng.uniform(0.5, 0.65)),
            rider if has_rider(look) else 0.8 if family == "child" else 1.05,
        )
    family = draw.option(MOTORCYCLES)
    length = (
        float(rng.uniform(1.75, 1.95)) if family in ("scooter", "moped") else float(rng.uniform(2.0, 2.25))
    )
    low = {"sport": 1.42, "cruiser": 1.5}.get(family, 1.56)
    return (
        length,
        float(rng.uniform(0.7, 0.85)),
        low + float(rng.uniform(0, 0.2)) if has_rider(look) else 1.15,
    )


def bicycle(size_m: Size, look: int, materials: Materials) -> list[Part]:
    """A bicycle, perhaps with its rider."""
    draw = Draw("bicycle", look)
    family = draw.option(BICYCLES)
    half, top = 0.5 * size_m[0], size_m[2]
    small = family in ("child", "folding")
    radius = 0.25 if small else 0.345
    kind = Semantic.BICYCLE

    def plain(colour: Colour, gloss: float = 0.0) -> int:
        return materials.add(paint.panel(draw.rng, colour), kind, gloss=gloss)

    frame, dark = plain(draw.bright() if draw.chance(0.6) else (26, 27, 30), 0.04), plain((26, 26, 28))
    steel = plain((150, 152, 156), 0.1)
    front, back = half - radius, radius - half
    saddle = (back + 0.42 * (front - back), 0.94 if not small else 0.74)
    crank = (back + 0.46 * (front - back), 0.29)
    bar_z = {"racing": 0.95, "city": 1.12, "child": 0.78}.get(family, 1.04)
    if not has_rider(look):
        bar_z = min(bar_z, top)
    bar_x = front - (0.12 if family == "racing" else 0.26)
    made = _bicycle_frame(
        family, (back, front, radius), saddle, crank, (bar_x, bar_z), frame, dark, size_m[1]
    )
    if draw.chance(0.55):
        made += [_guard((x, radius), radius + 0.03, dark) for x in (back, front)]
        made.append(box((back - radius - 0.02, 0, 1.55 * radius), (0.04, 0.06, 0.06), plain((190, 24, 26))))
        made.append(box((bar_x + 0.12, 0, bar_z - 0.16), (0.06, 0.07, 0.07), plain((226, 228, 230))))
    if family in ("city", "trekking", "cargo") and draw.chance(0.6):
        made.append(box((back, 0, 0.76), (0.36, 0.14, 0.03), dark))
        if draw.chance(0.4):
            made += [box((back, y, 0.58), (0.3, 0.12, 0.32), plain(draw.bright())) for y in (-0.13, 0.13)]
    if family == "cargo":
        made.append(box((front - 0.5, 0, 0.52), (0.6, 0.48, 0.4), plain(draw.bright())))
    parts = [Part(Mesh.joined(made))]
    for x in (back, front):
        parts.append(Part(_spoked(radius, dark, steel), rolling((x, 0.0, radius), radius)))
    if has_rider(look):
        lean = {"racing": 0.75, "mountain": 0.5, "city": 0.15, "child": 0.25}.get(family, 0.32)
        seat = _Seat(
            saddle, (bar_x - 0.04, bar_z), crank, 0.42 * size_m[1], lean, 0.16 if not small else 0.12
        )
        clothes = dress(draw, kind, materials, family == "child")
        helmet = plain(draw.bright()) if draw.chance(0.5) else None
        parts += _rider(draw, seat, top, clothes, helmet)
    return parts


def _bicycle_frame(
    family: str,
    wheels: tuple[float, float, float],
    saddle: tuple[float, float],
    crank: tuple[float, float],
    grip: tuple[float, float],
    frame: int,
    dark: int,
    width: float,
) -> list[Mesh]:
    back, front, radius = wheels
    neck = (grip[0] + 0.06, 0.0, 0.8 * grip[1])
    seat = (saddle[0], 0.0, saddle[1] - 0.1)
    low = (crank[0], 0.0, crank[1])
    step = (seat[0] + 0.1, 0.0, 0.5 * seat[2]) if family in ("city", "folding", "child") else seat
    tubes = [
        (low, seat, 0.02, frame),
        (low, (neck[0], 0.0, neck[2] - 0.1), 0.024, frame),
        (step, neck, 0.02, frame),
        ((seat[0], 0.0, seat[2]), (saddle[0], 0.0, saddle[1]), 0.014, dark),
        (neck, (grip[0], 0.0, grip[1]), 0.014, dark),
        ((grip[0], -0.45 * width, grip[1]), (grip[0], 0.45 * width, grip[1]), 0.015, dark),
    ]
    for y in (-0.05, 0.05):
        tubes += [
            ((back, y, radius), (low[0], 0.4 * y, low[2]), 0.012, frame),
            ((back, y, radius), (seat[0], 0.4 * y, seat[2] - 0.05), 0.011, frame),
            ((front, y, radius), (neck[0], 0.5 * y, neck[2] - 0.1), 0.014, frame),
        ]
    made = [bar(a, b, (r, r), m) for a, b, r, m in tubes]
    x, z = saddle
    made.append(box((x - 0.02, 0, z), (0.25, 0.12, 0.05), dark))
    made.append(
        cylinder((crank[0], -0.04, crank[1]), (crank[0], 0.04, crank[1]), (0.09, 0.09), dark, dark, 10)
    )
    return made


def _guard(at: tuple[float, float], radius: float, material: int) -> Mesh:
    """A mudguard over a wheel."""
    x, z = at
    turn = np.linspace(0.1, np.pi - 0.1, 8)
    points = [(x + radius * np.cos(a), z + radius * np.sin(a)) for a in turn]
    pieces = []
    for (x0, z0), (x1, z1) in itertools.pairwise(points):
        pieces.append(bar((x0, 0, z0), (x1, 0, z1), (0.025, 0.025), material))
    return Mesh.joined(pieces)


def _spoked(radius: float, tyre: int, steel: int) -> Mesh:
    """A wheel that can be seen through."""
    made = [
        ring_wheel(radius, 0.045, tyre),
        cylinder((0, -0.05, 0), (0, 0.05, 0), (0.03, 0.03), steel, steel, 6),
    ]
    for turn in np.arange(9) * 2 * np.pi / 9:
        tip = (0.95 * radius * np.cos(turn), 0.0, 0.95 * radius * np.sin(turn))
        made.append(bar((0, 0, 0), tip, (0.005, 0.005), steel))
    return Mesh.joined(made)


def motorcycle(size_m: Size, look: int, materials: Materials) -> list[Part]:
    """A scooter or a motorcycle, perhaps with its rider."""
    draw = Draw("motorcycle", look)
    family = draw.option(MOTORCYCLES)
    half, width, top = 0.5 * size_m[0], size_m[1], size_m[2]
    scooter = family in ("scooter", "moped")
    radius = 0.25 if family == "scooter" else 0.3 if family == "moped" else 0.32
    kind = Semantic.MOTORCYCLE

    def plain(colour: Colour, gloss: float = 0.0) -> int:
        return materials.add(paint.panel(draw.rng, colour), kind, gloss=gloss)

    body, dark, steel = plain(draw.paint(), 0.05), plain((26, 26, 28)), plain((150, 152, 156), 0.12)
    front, back = half - radius, radius - half
    bar_x, bar_z = front - 0.24, 1.0
    saddle = (back + 0.4 * (front - back), 0.76 if family != "cruiser" else 0.68)
    build = _scooter if scooter else _machine
    made = build(draw, family, (back, front, radius), (bar_x, bar_z), saddle, (body, dark, steel))
    grip = 0.45 * width
    made.append(cylinder((bar_x, -grip, bar_z), (bar_x, grip, bar_z), (0.018, 0.018), dark, dark, 6))
    for side in (-1, 1):
        made.append(
            bar((front, side * 0.08, radius), (bar_x + 0.03, side * 0.08, 0.9 * bar_z), (0.026, 0.026), steel)
        )
        stalk = (bar_x, side * 0.32 * width, bar_z)
        mirror = (bar_x - 0.02, side * 0.42 * width, min(bar_z + 0.15, top - 0.05))
        made.append(bar(stalk, mirror, (0.008, 0.008), dark))
        made.append(box(mirror, (0.02, 0.12, 0.08), dark))
    lit: Colour = (255, 252, 240) if draw.chance(0.7) else (214, 218, 222)
    made.append(egg((bar_x + 0.16, 0, 0.86), (0.06, 0.085, 0.085), plain(lit)))
    made.append(
        box(
            (-half + 0.16, 0, 0.72),
            (0.05, 0.16, 0.07),
            plain((255, 50, 40) if draw.chance(0.3) else (164, 20, 22)),
        )
    )
    made.append(box((-half + 0.1, 0, 0.56), (0.02, 0.2, 0.16), plain((232, 232, 228))))
    made += [_guard((front, radius), radius + 0.04, body)]
    parts = [Part(Mesh.joined(made))]
    for x in (back, front):
        disc = cylinder((0, -0.03, 0), (0, 0.03, 0), (0.55 * radius, 0.55 * radius), steel, steel, 10)
        wheel = Mesh.joined(
            [ring_wheel(radius, 0.13, dark, 18), disc, ring_wheel(0.75 * radius, 0.06, dark, 12)]
        )
        parts.append(Part(wheel, rolling((x, 0.0, radius), radius)))
    if has_rider(look):
        lean = {"sport": 0.6, "naked": 0.25}.get(family, 0.08)
        step = (saddle[0] + (0.42 if scooter or family == "cruiser" else 0.08), 0.32)
        seat = _Seat(saddle, (bar_x - 0.02, bar_z), step, grip - 0.05, lean)
        clothes = dress(draw, kind, materials, False)
        helmet = plain(
            draw.bright() if draw.chance(0.5) else draw.any_of(((24, 24, 26), (230, 230, 228))), 0.05
        )
        parts += _rider(draw, seat, top, clothes, helmet)
    return parts


def _loft_along(rows: Sequence[tuple[float, float, float, float]], material: int) -> Mesh:
    """A body along x: rows of place, half width, lower and upper edge."""
    table = np.array(rows)
    centres = np.zeros((len(table), 3))
    centres[:, 2] = table[:, 0]
    centres[:, 0] = -0.5 * (table[:, 2] + table[:, 3])
    lying = tube(
        centres, np.stack([0.5 * (table[:, 3] - table[:, 2]), table[:, 1]], axis=-1), material, 10, 2.6
    )
    return lying.moved(pitched((0, 0, 0), np.pi / 2))


def _machine(
    draw: Draw,
    family: str,
    wheels: tuple[float, float, float],
    grip: tuple[float, float],
    saddle: tuple[float, float],
    paints: tuple[int, int, int],
) -> list[Mesh]:
    """Tank, seat, engine, fairing and exhaust of a motorcycle."""
    back, _front, radius = wheels
    body, dark, steel = paints
    x, z = saddle
    made = [
        _loft_along(
            [
                (x + 0.1, 0, z, z + 0.1),
                (x + 0.14, 0.09, z - 0.05, z + 0.12),
                (x + 0.35, 0.14, z, z + 0.22),
                (grip[0] - 0.05, 0.1, z + 0.02, z + 0.18),
                (grip[0], 0, z + 0.1, z + 0.12),
            ],
            body,
        ),
        _loft_along(
            [
                (back - 0.1, 0, z + 0.08, z + 0.1),
                (back, 0.08, z, z + 0.12),
                (x, 0.13, z - 0.06, z + 0.03),
                (x + 0.2, 0.1, z - 0.04, z + 0.04),
                (x + 0.22, 0, z, z),
            ],
            dark,
        ),
        _loft_along(
            [
                (x - 0.1, 0, 0.4, 0.6),
                (x - 0.05, 0.16, 0.26, 0.66),
                (x + 0.42, 0.17, 0.24, 0.7),
                (x + 0.5, 0, 0.4, 0.6),
            ],
            steel if draw.chance(0.4) else dark,
        ),
        cylinder((x + 0.2, -0.15, 0.28), (back - 0.15, -0.19, 0.42), (0.035, 0.06), steel, steel, 8),
        bar((back, 0, radius), (x + 0.1, 0, 0.45), (0.05, 0.06), dark),
    ]
    if family in ("sport", "tourer"):
        made.append(
            _loft_along(
                [
                    (grip[0] - 0.2, 0, 0.6, 0.8),
                    (grip[0] - 0.15, 0.19, 0.36, 1.0),
                    (grip[0] + 0.12, 0.17, 0.5, 1.08),
                    (grip[0] + 0.26, 0, 0.72, 0.8),
                ],
                body,
            )
        )
    if family in ("tourer", "cruiser") and draw.chance(0.7):
        made += [box((back, y, 0.66), (0.44, 0.2, 0.32), body) for y in (-0.26, 0.26)]
    return made


def _scooter(
    draw: Draw,
    family: str,
    wheels: tuple[float, float, float],
    grip: tuple[float, float],
    saddle: tuple[float, float],
    paints: tuple[int, int, int],
) -> list[Mesh]:
    """Shield, floor, seat and tail of a scooter."""
    back, _, _ = wheels
    body, dark, steel = paints
    x, z = saddle
    shield = grip[0] + 0.02
    made = [
        _loft_along(
            [
                (back - 0.22, 0, 0.6, 0.66),
                (back - 0.1, 0.14, 0.42, 0.74),
                (x, 0.18, 0.3, 0.72),
                (x + 0.18, 0.13, 0.26, 0.68),
                (x + 0.2, 0, 0.3, 0.6),
            ],
            body,
        ),
        _loft_along(
            [
                (back - 0.2, 0, z, z + 0.02),
                (back - 0.1, 0.13, z - 0.04, z + 0.06),
                (x + 0.15, 0.12, z - 0.06, z + 0.02),
                (x + 0.2, 0, z - 0.03, z),
            ],
            dark,
        ),
        box((0.5 * (x + 0.1 + shield), 0, 0.27), (shield - x + 0.1, 0.32, 0.08), dark),
        cylinder((back + 0.1, -0.14, 0.27), (back - 0.22, -0.16, 0.32), (0.04, 0.05), steel, steel, 8),
    ]
    if family == "scooter":
        made.append(
            _loft_along(
                [
                    (shield - 0.1, 0, 0.3, 0.5),
                    (shield - 0.06, 0.19, 0.26, 0.86),
                    (shield + 0.06, 0.16, 0.3, 0.96),
                    (shield + 0.14, 0, 0.5, 0.9),
                ],
                body,
            )
        )
    if draw.chance(0.3):
        case = materials_box(draw, body, dark)
        made.append(box((back - 0.1, 0, z + 0.24), (0.42, 0.42, 0.36), case))
    return made


def materials_box(draw: Draw, body: int, dark: int) -> int:
    """Material of a case for parcels."""
    return draw.any_of((body, dark))


def _rider(draw: Draw, seat: _Seat, top_m: float, clothes: Clothes, helmet: int | None) -> list[Part]:
    """Somebody who sits, holds the bar and turns the pedals."""
    above = 0.5 * np.cos(seat.lean_rad) + 0.012
    height = float(np.clip((top_m - seat.hip[1]) / above, 0.9, 2.1))
    hip = np.array([seat.hip[0], 0.0, seat.hip[1] + 0.04])
    lean = pitched((0, 0, 0), seat.lean_rad)
    upright = np.array([0, 0, 0.5 * height])
    lean[:3, 3] = hip - lean[:3, :3] @ upright
    sits = Clothes(
        **{
            **vars(clothes),
            "outfit": "jacket" if clothes.outfit in ("coat", "skirt", "robe") else clothes.outfit,
        }
    )
    crown = height * 0.995
    mesh = Mesh.joined([trunk(height, sits).moved(lean), head(draw, crown, sits, helmet).moved(lean)])
    mesh = mesh.moved(
        np.block(
            [
                [np.eye(3), np.array([[0.0], [0.0], [top_m - mesh.corners[..., 2].max()]])],
                [np.zeros((1, 3)), 1.0],
            ]
        )
    )
    parts = [Part(mesh)]
    leg, arm = (0.25 * height, 0.245 * height), (0.165 * height, 0.17 * height)
    for side in (1.0, -1.0):
        joint = hip + np.array([0.0, side * 0.055 * height, 0.0])
        shoulder = (lean @ np.array([0, side * 0.11 * height * sits.girth, 0.79 * height, 1.0]))[:3]
        hand = np.array([seat.hand[0], side * seat.hand_wide, seat.hand[1] + 0.02])

        def foot(way_m: float, side: float = side) -> np.ndarray:
            turn = way_m / 0.8 + (np.pi if side < 0 else 0.0)
            x, z = seat.pedal
            return np.array(
                [x + seat.crank_m * np.sin(turn), side * 0.11, z + seat.crank_m * np.cos(turn) + 0.06]
            )

        def knee(way_m: float, joint=joint, foot=foot, side=side) -> np.ndarray:
            return bent(joint, foot(way_m), leg, np.array([1.0, 0.12 * side, 0.35]))

        def ankle(way_m: float, knee=knee, foot=foot) -> np.ndarray:
            at = knee(way_m)
            line = foot(way_m) - at
            return at + line * leg[1] / max(float(np.linalg.norm(line)), 1e-9)

        elbow = bent(shoulder, hand, arm, np.array([-0.3, 0.35 * side, -0.8]))
        wide = height * (0.5 + 0.5 * sits.girth)
        parts += [
            limb(lambda _, at=joint: at, knee, (0.05 * wide, 0.036 * wide), sits.legs),
            limb(knee, ankle, (0.035 * wide, 0.025 * wide), sits.legs, sits.shoes),
            limb(lambda _, at=shoulder: at, lambda _, at=elbow: at, (0.033 * wide, 0.027 * wide), sits.top),
            limb(lambda _, at=elbow: at, lambda _, at=hand: at, (0.026 * wide, 0.021 * wide), sits.top),
        ]
    return parts
