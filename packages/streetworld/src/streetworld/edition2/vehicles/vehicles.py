"""Cars and vans."""

from dataclasses import dataclass

from dreamdrive.scene.street.layout import BoxKind
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.layouts.variants import Colour, Draw
from streetworld.edition2.vehicles.car_families import CARS, CARS_KEPT_OUT
from streetworld.edition2.vehicles.family import Family
from streetworld.edition2.vehicles.parts.body_materials import Coats
from streetworld.edition2.vehicles.parts.canvas import lettering
from streetworld.edition2.vehicles.parts.fittings import TAXI, Fittings
from streetworld.edition2.vehicles.parts.fronts import GRILLES, HEADS
from streetworld.edition2.vehicles.parts.loft import ViewSide, projected
from streetworld.edition2.vehicles.parts.side_pictures import paint_skin
from streetworld.edition2.vehicles.parts.trim import Letters, Trim, shaded
from streetworld.edition2.vehicles.parts.wheels import wheels
from streetworld.edition2.vehicles.shape import BodyShape, body_mesh
from streetworld.edition2.vehicles.van_families import VANS, VANS_KEPT_OUT
from streetworld.engine.bodies import Part, Size
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh

GLOSS = 0.05
"""Light that paint and glass mirror when seen from straight above."""

_PLASTIC: Colour = (36, 37, 39)
_WHITE_PLATE: Colour = (232, 232, 228)
_YELLOW_PLATE: Colour = (226, 184, 52)
_WHITE: Colour = (228, 229, 228)
_SERVICE: tuple[Colour, ...] = (_WHITE, _WHITE, (24, 26, 32), (188, 192, 196))
_TAXIS: tuple[Colour, ...] = (TAXI, (224, 212, 178), (24, 24, 26), _WHITE)
_BANDS: tuple[Colour, ...] = ((26, 62, 150), (30, 110, 60), (206, 40, 36), (230, 196, 40))
_INKS: tuple[Colour, ...] = ((28, 30, 40), (24, 60, 140), (180, 30, 34), (20, 104, 60))


def family_of(draw: Draw) -> Family:
    """The family of a car's or van's look; those of looks kept out are others than those of the rest."""
    tables = (CARS, CARS_KEPT_OUT) if draw.kind == "car" else (VANS, VANS_KEPT_OUT)
    table = tables[draw.kept_out]
    at = draw.rng.random() * sum(share for share, _ in table)
    for share, family in table:
        at -= share
        if at <= 0:
            return family
    return table[-1][1]


def vehicle_size(kind: BoxKind, look: int) -> Size:
    """Length, width and height that fit the family of a look."""
    draw = Draw(kind, look)
    family = family_of(draw)
    length, width, height = family.size(draw)
    return length, width, height + Fittings(draw, family).on_roof_m


def vehicle(kind: BoxKind, size_m: Size, look: int, materials: Materials) -> list[Part]:
    """A car or a van."""
    draw = Draw(kind, look)
    family = family_of(draw)
    family.size(draw)  # so that what follows is drawn alike whatever the box
    fittings = Fittings(draw, family)
    length, width, height = size_m
    bare = length, width, height - fittings.on_roof_m
    shape = family.shape(draw, bare)
    coats = Coats(draw, Semantic.CAR if kind == "car" else Semantic.VAN, materials)
    trim = _trim(draw, shape, family, _livery(draw, shape, family, fittings.role))
    skin = [coats.picture(image, GLOSS) for image in paint_skin(draw, shape, trim)]
    meshes = [projected(body_mesh(shape), bare, skin)]
    meshes += fittings.meshes(shape, skin[ViewSide.TOP], skin[ViewSide.UNDER], coats)
    return [Part(Mesh.joined(meshes)), *wheels(draw, shape, coats)]


@dataclass(frozen=True)
class _Livery:
    """Colours of body and roof, a band along the sides, and letters."""

    colour: Colour
    roof: Colour
    band: Colour | None = None
    letters: Letters | None = None


def _livery(draw: Draw, shape: BodyShape, family: Family, role: str) -> _Livery:
    car = draw.kind == "car"
    length, height = shape.length, shape.height
    if role == "taxi":
        colour = draw.any_of((*_TAXIS, draw.paint()))
        return _Livery(colour, colour)
    if role == "police":
        colour = draw.any_of(_SERVICE)
        name = draw.any_of(("POLICE", "POLIZEI", "POLICIA"))
        letters = Letters([(name, (-0.28 * length, 0.5 * shape.cowl_z), 0.2)], _ink(draw, colour))
        return _Livery(colour, colour, draw.any_of(_BANDS), letters)
    if car:
        colour = draw.paint()
        return _Livery(colour, draw.any_of(((20, 21, 23), _WHITE)) if draw.chance(0.1) else colour)
    colour = draw.paint() if draw.chance(0.35) else draw.near(_WHITE, 6)
    band, letters = draw.any_of(_BANDS) if draw.chance(0.12) else None, None
    if len(family.panes) == 1 and draw.chance(0.6):
        z = float(draw.rng.uniform(0.5, 0.72)) * height
        high = float(draw.rng.uniform(0.2, 0.42)) * (0.7 if height < 2.1 else 1.0)
        place = (-0.44 * length, z), (-0.44 * length, z - 0.8 * high)
        words = [(lettering(draw.rng), place[0], high), (lettering(draw.rng, 8, 14), place[1], 0.35 * high)]
        letters = Letters(words, _ink(draw, colour))
    return _Livery(colour, colour, band, letters)


def _ink(draw: Draw, colour: Colour) -> Colour:
    """A colour of letters that can be read on another."""
    return draw.any_of(_INKS) if sum(colour) > 350 else (236, 236, 232)


def _trim(draw: Draw, shape: BodyShape, family: Family, livery: _Livery) -> Trim:
    colour, nose, car = livery.colour, shape.nose_z, draw.kind == "car"
    clad, old = draw.chance(family.clad), family.name == "old saloon"
    head, grille = draw.option(range(HEADS)), draw.option(range(GRILLES))
    return Trim(
        colour=colour,
        roof=livery.roof,
        low=draw.near(_PLASTIC, 1) if clad or not car or draw.chance(0.4) else shaded(colour, 0.8),
        panes=family.panes,
        doors=family.doors,
        head=1 if old else head,
        tail=draw.any_of(family.tails),
        grille=3 if old else grille,
        head_z=(nose * draw.between(0.7, 0.76), nose * draw.between(0.9, 0.97)),
        plates=(
            None if draw.chance(0.06) else _WHITE_PLATE,
            _YELLOW_PLATE if draw.chance(0.12) else _WHITE_PLATE,
        ),
        tint=shaded((38, 42, 46), draw.between(0.6, 1.25)),
        privacy=draw.between(0.45, 1.0),
        see_through=draw.between(0.2, 0.9),
        joined_panes=len(family.panes) > 1,
        bumper=draw.near((52, 53, 55), 2) if draw.chance(0.05 if car else 0.55) or old else None,
        sill_m=draw.between(0.04, 0.14),
        head_m=draw.between(0.2, 0.42),
        crease=draw.between(0, 1),
        clad=clad,
        rubbing=draw.chance(0.3),
        chrome=draw.chance(0.25),
        handle=draw.any_of(((26, 26, 28), (196, 198, 200), shaded(colour, 0.92))),
        lit=draw.chance(0.3),
        head_lit=draw.chance(0.35),
        dirt=float(draw.rng.beta(1.2, 5)),
        sunroof=car and draw.chance(0.2),
        band=livery.band,
        band_z=(0.4 * shape.cowl_z, 0.75 * shape.cowl_z),
        letters=livery.letters,
        bed=(30, 30, 32) if family.name == "pickup" else None,
        rear_window=car or draw.chance(0.6),
        split_doors=not car and family.name != "people carrier",
    )
