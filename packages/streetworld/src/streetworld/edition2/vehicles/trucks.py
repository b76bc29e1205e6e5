"""Trucks: a cab, a chassis, and what is carried on it."""

import numpy as np

from dreamdrive.scene.level import pitched
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.layouts.variants import Colour, Draw
from streetworld.edition2.vehicles.cargo import CARGO, Load
from streetworld.edition2.vehicles.parts.fronts import GRILLES, HEADS
from streetworld.edition2.vehicles.parts.loft import projected, smooth
from streetworld.edition2.vehicles.parts.side_pictures import paint_skin
from streetworld.edition2.vehicles.parts.trim import Trim
from streetworld.edition2.vehicles.parts.wheels import rim, wheel_pairs
from streetworld.edition2.vehicles.shape import BodyShape, body_mesh
from streetworld.engine.bodies import Part, Size
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh, box, cylinder

_CABS: tuple[Colour, ...] = (
    (230, 231, 230),
    (230, 231, 230),
    (190, 30, 34),
    (30, 70, 150),
    (226, 178, 40),
    (40, 110, 70),
    (228, 110, 36),
    (30, 32, 36),
    (150, 154, 158),
)
_WHITE: Colour = (232, 232, 228)
_LONGEST_RIGID_M = 10.5


def truck_size(look: int) -> Size:
    """Length, width and height of a look."""
    draw = Draw("truck", look)
    return _size(draw, draw.option(CARGO))


def _size(draw: Draw, cargo: str) -> Size:
    rng = draw.rng
    if cargo.startswith("semi"):
        return float(rng.uniform(12.0, 14.0)), 2.55, float(rng.uniform(3.7, 4.05))
    length = 5.2 + 4.8 * draw.between(0, 1)
    grown = (length - 5.2) / 4.8
    width = 2.05 + 0.45 * grown + float(rng.uniform(0, 0.08))
    low = {"flatbed": 2.3, "tipper": 2.5}.get(cargo, 2.7)
    return length, width, low + 0.9 * grown + float(rng.uniform(0, 0.35))


def truck(size_m: Size, look: int, materials: Materials) -> list[Part]:
    """A truck that fills its box."""
    draw = Draw("truck", look)
    cargo = draw.option(CARGO)
    _size(draw, cargo)
    length, width, height = size_m
    semi = cargo.startswith("semi")
    half = 0.5 * length
    heavy = min(1.0, max(0.0, (length - 5.2) / 4.8))
    radius = 0.38 + 0.13 * heavy
    bonnet = 1.0 if draw.kept_out and not semi else 0.0
    cab_m = 1.65 + 0.5 * heavy + bonnet + (0.3 if semi else 0.0)
    cab_high = (
        height
        if cargo == "flatbed"
        else min(height, (2.25 + 0.75 * heavy) * float(draw.rng.uniform(0.95, 1.1)))
    )
    cab = _cab_shape(draw, (cab_m, width - 0.04, cab_high), radius, bonnet)
    trim = _cab_trim(draw, cab)
    paints = [materials.add(i, Semantic.TRUCK, gloss=0.05) for i in paint_skin(draw, cab, trim)]
    shell = body_mesh(cab)
    shell.corners[..., 2] *= cab_high / shell.corners[..., 2].max()
    seat = pitched((half - 0.5 * cab_m, 0, 0), 0.0)
    meshes = [projected(shell, (cab_m, width - 0.04, cab_high), paints).moved(seat)]
    for side in (-1, 1):
        at = (half - 0.18 - bonnet, side * (0.5 * width + 0.06), 0.72 * cab_high)
        meshes.append(box(at, (0.12, 0.18, 0.42), paints[-1]))
    load = Load(
        draw, cargo, (-half, half - cab_m - (0.45 if semi else 0.12)), width, height, 2 * radius + 0.1
    )
    meshes += load.meshes(materials)
    deflector = cargo not in ("flatbed", "tipper", "mixer") and height - cab_high > 0.35
    if deflector and draw.chance(0.6):
        x, z = half - 0.5 * cab_m - 0.1, 0.5 * (cab_high + height) - 0.1
        wing = box((0, 0, 0), (0.06, 0.8 * width, height - cab_high), paints[4])
        meshes.append(wing.moved(pitched((x, 0, z), -0.7)))
    front = half - cab_m + cab.axles[0] + 0.5 * cab_m
    axles = _axles(semi, half, front, heavy, draw)
    meshes += _chassis(half, cab_m, width, radius, axles, paints[-1], materials)
    face = materials.add(rim(draw, 0.6), Semantic.TRUCK, gloss=0.03)
    tyre = materials.add(np.full((8, 8, 3), 26, dtype=np.uint8), Semantic.TRUCK)
    pairs = wheel_pairs(axles, radius, width - 0.02, (tyre, face), 0.36)
    return [Part(Mesh.joined(meshes)), *pairs]


def _axles(semi: bool, half: float, front: float, heavy: float, draw: Draw) -> tuple[float, ...]:
    if semi:
        drive = front - float(draw.rng.uniform(3.0, 3.6))
        last = -half + float(draw.rng.uniform(1.2, 2.4))
        return (front, drive, last, last + 1.3, last + 2.6)
    last = -half + float(draw.rng.uniform(0.2, 0.28)) * 2 * half
    return (front, last) if heavy < 0.55 or draw.chance(0.4) else (front, last, last + 1.3)


def _cab_shape(draw: Draw, size_m: Size, radius_m: float, bonnet_m: float) -> BodyShape:
    length, width, height = size_m
    half = 0.5 * length
    cowl_z = 0.53 * height if not bonnet_m else 0.6 * height
    cowl = half - 0.03 - bonnet_m
    axle = half - (0.72 if bonnet_m else 0.62 * length)
    return BodyShape(
        length=length,
        width=width,
        height=height,
        cowl=cowl,
        screen=cowl - float(draw.rng.uniform(0.08, 0.28)),
        roof=-half + 0.05,
        deck=-half + 0.03,
        nose_z=cowl_z - (0.14 if bonnet_m else 0.02),
        cowl_z=cowl_z,
        deck_z=cowl_z,
        tail_z=cowl_z - 0.01,
        roof_drop=0.02,
        clearance=0.75 * radius_m,
        wheel=radius_m,
        axles=(max(axle, -half + 1.2 * radius_m),),
        tumble=float(draw.rng.uniform(0.92, 0.97)),
        round_plan=float(draw.rng.uniform(7, 14)),
        round_roof=float(draw.rng.uniform(0.1, 0.3)),
        bulge=0.02,
    )


def _cab_trim(draw: Draw, shape: BodyShape) -> Trim:
    colour = draw.near(draw.any_of(_CABS), 8)
    nose = shape.nose_z
    return Trim(
        colour=colour,
        roof=colour,
        low=(40, 41, 44),
        panes=((0.05, 0.72 if draw.chance(0.7) else 0.9),),
        doors=((0.02, 0.76, False),),
        head=draw.option(range(HEADS)),
        tail=1,
        grille=int(draw.any_of((0, 1, 3))) if not draw.kept_out else GRILLES - 1,
        head_z=(nose * 0.42, nose * 0.55),
        plates=(_WHITE, _WHITE),
        tint=draw.near((36, 40, 44), 2),
        see_through=0.5,
        joined_panes=False,
        bumper=draw.near((70, 72, 75), 3) if draw.chance(0.4) else None,
        sill_m=0.2,
        head_m=0.12,
        handle_z=0.8 * nose,
        head_lit=draw.chance(0.4),
        dirt=float(draw.rng.beta(1.6, 4)),
        rear_window=False,
    )


def _chassis(
    half: float,
    cab_m: float,
    width: float,
    radius: float,
    axles: tuple[float, ...],
    dark: int,
    materials: Materials,
) -> list[Mesh]:
    """Frame, mudguards, tanks and bars against cars that would drive under."""
    back, front = -half + 0.15, half - cab_m + 0.3
    middle, long = 0.5 * (back + front), front - back
    frame = box((middle, 0, 2 * radius), (long, 0.9, 0.26), dark)
    steel = materials.add(np.full((8, 8, 3), (150, 152, 154), dtype=np.uint8), Semantic.TRUCK, gloss=0.1)
    gap = axles[0] - axles[1] - 2.6 * radius
    made = [frame]
    tank = min(1.3, 0.45 * gap)
    if tank > 0.4:
        x = axles[0] - 1.25 * radius - 0.5 * tank
        for side in (-1, 1):
            y = side * (0.5 * width - 0.35)
            made.append(
                smooth(
                    cylinder(
                        (x - 0.5 * tank, y, 1.4 * radius),
                        (x + 0.5 * tank, y, 1.4 * radius),
                        (0.28, 0.28),
                        steel,
                        steel,
                        10,
                    )
                )
            )
    if gap > 1.5:
        x0 = axles[1] + 1.3 * radius
        x1 = axles[0] - 1.3 * radius - tank
        for side in (-1, 1):
            for z in (1.1 * radius, 1.7 * radius):
                made.append(
                    box((0.5 * (x0 + x1), side * (0.5 * width - 0.06), z), (x1 - x0, 0.04, 0.1), steel)
                )
    for x in axles[1:]:
        for side in (-1, 1):
            made.append(box((x, side * (0.5 * width - 0.22), 2.1 * radius), (2.3 * radius, 0.38, 0.04), dark))
    return made
