"""Buses: city buses, coaches, double deckers, small and school buses."""

from dataclasses import dataclass

from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.layouts.variants import Colour, Draw
from streetworld.edition2.vehicles.parts.body_materials import Coats
from streetworld.edition2.vehicles.parts.canvas import lettering
from streetworld.edition2.vehicles.parts.fronts import HEADS
from streetworld.edition2.vehicles.parts.loft import projected
from streetworld.edition2.vehicles.parts.side_pictures import paint_skin
from streetworld.edition2.vehicles.parts.trim import Letters, Trim, shaded
from streetworld.edition2.vehicles.parts.wheels import wheels
from streetworld.edition2.vehicles.shape import BodyShape, body_mesh
from streetworld.engine.bodies import Part, Size
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh, box

_COLOURS: tuple[Colour, ...] = (
    (228, 228, 226),
    (190, 30, 34),
    (30, 76, 150),
    (40, 120, 70),
    (226, 178, 40),
    (110, 40, 110),
    (150, 154, 158),
    (30, 32, 38),
    (90, 160, 200),
)
_SIZES = {
    "city": ((9.5, 12.4), (2.44, 2.55), (2.85, 3.25)),
    "coach": ((10.5, 13.8), (2.48, 2.55), (3.3, 3.8)),
    "small": ((6.4, 8.6), (2.1, 2.4), (2.6, 2.95)),
    "double decker": ((9.4, 11.4), (2.5, 2.55), (4.0, 4.4)),
    "old": ((9.0, 11.8), (2.4, 2.5), (2.9, 3.2)),
    "school": ((8.5, 12.0), (2.3, 2.45), (2.9, 3.25)),
}
_FAMILIES = (
    "city",
    "city",
    "city",
    "city",
    "coach",
    "coach",
    "small",
    "double decker",
    "old",
    "school",
    "school",
)
"""By their shares; the last two are those of looks kept out."""


@dataclass(frozen=True)
class _Lay:
    """Where a bus has its windscreen and windows, as shares of its length and height."""

    cowl: float
    cowl_z: float
    panes_z: tuple[tuple[float, float], ...]
    tint: float


_LAYS = {
    "city": _Lay(0.004, 0.36, ((0.4, 0.84),), 1.0),
    "coach": _Lay(0.012, 0.34, ((0.5, 0.88),), 0.6),
    "small": _Lay(0.05, 0.42, ((0.46, 0.84),), 0.9),
    "double decker": _Lay(0.006, 0.24, ((0.26, 0.44), (0.62, 0.86)), 1.0),
    "old": _Lay(0.006, 0.46, ((0.5, 0.82),), 1.2),
    "school": _Lay(0.15, 0.52, ((0.56, 0.84),), 1.0),
}


def bus_size(look: int) -> Size:
    """Length, width and height of a look."""
    draw = Draw("bus", look)
    return _size(draw, draw.option(_FAMILIES))


def _size(draw: Draw, family: str) -> Size:
    length, width, height = (float(draw.rng.uniform(*each)) for each in _SIZES[family])
    return length, width, height


def bus(size_m: Size, look: int, materials: Materials) -> list[Part]:
    """A bus that fills its box."""
    draw = Draw("bus", look)
    family = draw.option(_FAMILIES)
    _size(draw, family)
    shape = _shape(draw, family, size_m)
    trim = _trim(draw, family, shape)
    skin = paint_skin(draw, shape, trim)
    coats = Coats(draw, Semantic.BUS, materials)
    indices = [coats.picture(image, 0.05) for image in skin]
    meshes = [projected(body_mesh(shape), size_m, indices)]
    half, side = 0.5 * shape.length, 0.5 * shape.width
    z = 0.7 * size_m[2] if family != "double decker" else 0.42 * size_m[2]
    for sign in (-1, 1):
        meshes.append(box((half + 0.02, sign * (side + 0.05), z), (0.1, 0.2, 0.36), indices[-1]))
    if family in ("city", "small") and draw.chance(0.6):
        low = (float(draw.rng.uniform(1.5, 3.0)), 0.75 * shape.width, 0.2)
        meshes.append(
            box((draw.rng.uniform(-0.2, 0.15) * shape.length, 0, size_m[2] - 0.08), low, indices[4])
        )
    return [Part(Mesh.joined(meshes)), *wheels(draw, shape, coats, 0.28)]


def _shape(draw: Draw, family: str, size_m: Size) -> BodyShape:
    length, width, height = size_m
    lay, half = _LAYS[family], 0.5 * length
    cowl = half - lay.cowl * length - 0.02
    lean = {"coach": 0.5, "school": 0.12, "old": 0.06}.get(family, 0.12)
    nose_z = lay.cowl_z * height - (0.02 if family != "school" else 0.12)
    axles = (half - float(draw.rng.uniform(2.3, 2.7)), -half + float(draw.rng.uniform(2.4, 3.2)))
    if family == "school":
        axles = (half - 0.9, axles[1])
    if family == "small":
        axles = (half - 1.0, -half + 1.7)
    if family == "coach" and length > 12.3:
        axles = (*axles, axles[1] - 1.3) if axles[1] - 1.3 > 1.0 - half else axles
    return BodyShape(
        length=length,
        width=width,
        height=height,
        cowl=cowl,
        screen=cowl - lean * float(draw.rng.uniform(0.7, 1.3)),
        roof=-half + 0.06,
        deck=-half + 0.03,
        nose_z=nose_z,
        cowl_z=lay.cowl_z * height,
        deck_z=lay.cowl_z * height,
        tail_z=lay.cowl_z * height - 0.01,
        roof_drop=0.01,
        clearance=float(draw.rng.uniform(0.24, 0.34)),
        wheel=0.38 if family == "small" else 0.48,
        axles=axles,
        tumble=float(draw.rng.uniform(0.95, 0.985)),
        round_plan=float(draw.rng.uniform(14, 26)) * (0.6 if family == "coach" else 1),
        round_roof=0.2 if family in ("school", "old") else 0.11,
        bulge=0.012,
    )


def _trim(draw: Draw, family: str, shape: BodyShape) -> Trim:
    rng, half, height = draw.rng, 0.5 * shape.length, shape.height
    lay = _LAYS[family]
    colour = draw.near((230, 170, 30) if family == "school" else draw.any_of(_COLOURS), 9)
    roof = colour if draw.chance(0.6) else draw.near((225, 225, 222), 5)
    count = max(4, round(shape.length / float(rng.uniform(1.2, 1.75))))
    front = shape.cowl - 0.55
    rows = tuple((-half + 0.5, front, a * height, b * height, count) for a, b in lay.panes_z)
    places = {"city": (0.42, 0.02, -0.28), "double decker": (0.43, -0.02)}.get(family, (0.42,))
    top = lay.panes_z[0][1] * height
    gates = tuple(
        (x * shape.length - 0.6, x * shape.length + 0.6, shape.clearance + 0.06, top) for x in places
    )
    band = draw.any_of(_COLOURS) if draw.chance(0.5) else None
    low_z = float(rng.uniform(0.12, 0.25)) * height
    ink: Colour = (32, 34, 44) if sum(colour) > 350 else (238, 238, 234)
    letters = None
    if draw.chance(0.6):
        at = (float(rng.uniform(-0.4, -0.1)) * shape.length, 0.24 * height)
        letters = Letters([(lettering(rng), at, float(rng.uniform(0.25, 0.55)))], ink)
        if family == "school":
            letters = Letters([("SCHOOL BUS", (-0.2 * shape.length, 0.88 * height), 0.22)], (24, 24, 26))
    return Trim(
        colour=colour,
        roof=roof,
        low=shaded(colour, 0.75) if draw.chance(0.5) else (38, 39, 42),
        panes=(),
        doors=(),
        head=draw.option(range(HEADS)),
        tail=1 if draw.chance(0.6) else 5,
        grille=4,
        head_z=(0.18 * height, 0.25 * height),
        plates=((232, 232, 228), (232, 232, 228) if draw.chance(0.8) else (226, 184, 52)),
        tint=draw.near(shaded((42, 47, 52), lay.tint), 2),
        see_through=0.75 * lay.tint,
        joined_panes=draw.chance(0.7),
        sill_m=0.04,
        head_m=0.12,
        lit=draw.chance(0.3),
        head_lit=draw.chance(0.5),
        dirt=float(rng.beta(1.3, 5)),
        band=band,
        band_z=(low_z, low_z + float(rng.uniform(0.1, 0.6))),
        letters=letters,
        rear_window=draw.chance(0.75),
        sign=f"{int(rng.integers(1, 300))} {lettering(rng)}",
        rows=rows,
        gates=gates,
        gates_right=draw.chance(0.8),
    )
