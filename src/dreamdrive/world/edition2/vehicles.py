"""Cars and vans."""

import numpy as np

from dreamdrive.scene.layout import BoxKind
from dreamdrive.world.bodies import Part, Size
from dreamdrive.world.edition2.canvas import lettering
from dreamdrive.world.edition2.draw import Colour, Draw
from dreamdrive.world.edition2.ends import GRILLES, HEADS
from dreamdrive.world.edition2.families import Family, family_of
from dreamdrive.world.edition2.loft import projected, smooth
from dreamdrive.world.edition2.shape import Shape, body_mesh
from dreamdrive.world.edition2.skin import paint_skin
from dreamdrive.world.edition2.trim import Letters, Trim
from dreamdrive.world.edition2.wheels import wheels
from dreamdrive.world.materials import Materials, Semantic
from dreamdrive.world.mesh import Mesh, box, frustum

_PLASTIC: Colour = (36, 37, 39)
_WHITE_PLATE: Colour = (232, 232, 228)
_YELLOW_PLATE: Colour = (226, 184, 52)
_TAXI: Colour = (236, 196, 44)
GLOSS = 0.05


def vehicle_size(kind: BoxKind, look: int) -> Size:
    """Length, width and height that fit the family of a look."""
    draw = Draw(kind, look)
    family = family_of(draw)
    length, width, height = family.size(draw)
    return length, width, height + _Fittings(draw, family, kind == "car").on_roof_m


def vehicle(kind: BoxKind, size_m: Size, look: int, materials: Materials) -> list[Part]:
    """A car or a van."""
    draw = Draw(kind, look)
    family = family_of(draw)
    family.size(draw)  # so that what follows is drawn alike whatever the box
    semantic = Semantic.CAR if kind == "car" else Semantic.VAN
    fittings = _Fittings(draw, family, kind == "car")
    bare = (size_m[0], size_m[1], size_m[2] - fittings.on_roof_m)
    shape = family.shape(draw, bare)
    trim = _trim(draw, shape, family, kind == "car", fittings)
    skin = paint_skin(draw, shape, trim)
    indices = [materials.add(image, semantic, gloss=GLOSS) for image in skin]
    shell = body_mesh(shape)
    shell.corners[..., 2] *= bare[2] / shell.corners[..., 2].max()
    meshes = [projected(shell, bare, indices)]
    meshes += fittings.meshes(shape, indices, materials, semantic)
    return [Part(Mesh.joined(meshes)), *wheels(draw, shape, shape.width, materials, semantic)]


class _Fittings:
    """What is fixed to a body: mirrors, and perhaps a roof rack, a taxi's sign, a light bar, a load."""

    def __init__(self, draw: Draw, family: Family, car: bool) -> None:
        self._draw = draw
        pickup = family.name == "pickup"
        at = draw.rng.random()
        self.role = "plain"
        if car and not pickup:
            self.role = "taxi" if at < 0.06 else "police" if at < 0.085 else "plain"
        self.rack = self.role == "plain" and not pickup and draw.chance(0.14)
        self.roof_box = self.rack and draw.chance(0.25)
        self.load = pickup and draw.chance(0.4)
        self.spare = family.name == "off-roader" and draw.chance(0.5)
        self.on_roof_m = (
            0.3 if self.roof_box else 0.11 if self.role != "plain" else 0.05 if self.rack else 0.0
        )

    def meshes(self, shape: Shape, body: list[int], materials: Materials, semantic: Semantic) -> list[Mesh]:
        """Their triangles; ``body`` are the materials of the six sides."""
        under = body[-1]
        made = [_mirror(shape, side, body[4], under) for side in (1.0, -1.0)]

        def plain(colour: Colour) -> int:
            return materials.add(np.full((8, 8, 3), colour, dtype=np.uint8), semantic, gloss=0.03)

        roof = shape.rail_at(0.5 * (shape.roof + shape.screen)) + 0.6 * shape.round_roof
        middle, wide = 0.5 * (shape.roof + shape.screen), 2 * shape.roof_half()
        top = shape.height + self.on_roof_m
        if self.rack:
            long = 0.6 * (shape.screen - shape.roof)
            bar = plain((40, 41, 44))
            for y in (-0.42 * wide, 0.42 * wide):
                made.append(box((middle, y, roof + 0.03), (long, 0.035, 0.035), bar))
            for x in (middle - 0.3 * long, middle + 0.3 * long):
                made.append(box((x, 0, 0.5 * (roof + shape.height) + 0.04), (0.05, 0.9 * wide, 0.03), bar))
        if self.roof_box:
            low = (middle - 0.9, middle + 0.7, -0.3, 0.3)
            high = (middle - 0.8, middle + 0.45, -0.25, 0.25)
            made.append(smooth(frustum(low, high, (shape.height, top), [plain((34, 35, 38))] * 6), 1.0))
        if self.role == "taxi":
            sign = plain(_TAXI)
            made.append(
                frustum(
                    (middle, middle + 0.16, -0.28, 0.28),
                    (middle + 0.04, middle + 0.12, -0.24, 0.24),
                    (roof, top),
                    [sign] * 6,
                )
            )
        if self.role == "police":
            for side, colour in ((1, (40, 70, 220)), (-1, self._draw.any_of(((220, 30, 34), (40, 70, 220))))):
                made.append(
                    box(
                        (middle + 0.1, side * 0.3, 0.5 * (roof + top)),
                        (0.22, 0.56, top - roof),
                        plain(colour),
                    )
                )
        if self.load:
            made += self._loads(shape, plain)
        if self.spare:
            from dreamdrive.world.mesh import cylinder

            back, z = -0.5 * shape.length, 0.62 * shape.cowl_z + 0.2
            made.append(
                cylinder((back + 0.1, 0, z), (back + 0.0, 0, z), (0.34, 0.34), under, plain(_PLASTIC), 14)
            )
        return made

    def _loads(self, shape: Shape, plain) -> list[Mesh]:
        rng, made = self._draw.rng, []
        back, front = -0.5 * shape.length + 0.2, shape.deck - 0.2
        for _ in range(int(rng.integers(1, 5))):
            long, wide, high = rng.uniform(0.3, 0.9), rng.uniform(0.3, 1.0), rng.uniform(0.1, 0.45)
            x = rng.uniform(back + 0.5 * long, front - 0.5 * long)
            y = rng.uniform(-0.4, 0.4) * (shape.width - wide - 0.2)
            made.append(
                box((x, y, shape.tail_z + 0.5 * high), (long, wide, high), plain(self._draw.bright()))
            )
        return made


def _mirror(shape: Shape, side: float, paint: int, dark: int) -> Mesh:
    x, z = shape.cowl - 0.22 * (shape.cowl - shape.deck) ** 0.5 * 0.5, shape.edge_at(shape.cowl) + 0.12
    y0, y1 = shape.foot_half() - 0.02, 0.5 * shape.width + 0.09
    low = (x - 0.06, x + 0.1, *sorted((side * y0, side * y1)))
    high = (x - 0.05, x + 0.05, *sorted((side * (y0 + 0.03), side * y1)))
    return frustum(low, high, (z - 0.07, z + 0.08), (paint, paint, dark, paint, paint, dark))


def _trim(draw: Draw, shape: Shape, family: Family, car: bool, fittings: _Fittings) -> Trim:
    colour = draw.paint() if car or draw.chance(0.35) else draw.near((228, 229, 228), 6)
    roof = colour
    if car and draw.chance(0.1):
        roof = draw.any_of(((20, 21, 23), (222, 222, 220)))
    letters, band = None, None
    if fittings.role == "taxi":
        colour = roof = draw.any_of((_TAXI, (224, 212, 178), (24, 24, 26), (232, 232, 230), colour))
    if fittings.role == "police" or (not car and draw.chance(0.12)):
        colour = roof = draw.any_of(((230, 231, 232), (230, 231, 232), (24, 26, 32), (188, 192, 196)))
        band = draw.any_of(((26, 62, 150), (30, 110, 60), (206, 40, 36), (230, 196, 40)))
    ink = (
        draw.any_of(((28, 30, 40), (24, 60, 140), (180, 30, 34), (20, 104, 60)))
        if sum(colour) > 350
        else (236, 236, 232)
    )
    low_z = 0.5 * shape.cowl_z
    if fittings.role == "police":
        letters = Letters(
            [(draw.any_of(("POLICE", "POLIZEI", "POLICIA")), (-0.28 * shape.length, low_z), 0.2)], ink
        )
    elif not car and len(family.panes) == 1 and draw.chance(0.6):
        z = float(draw.rng.uniform(0.5, 0.72)) * shape.height
        high = float(draw.rng.uniform(0.2, 0.42)) * (0.7 if shape.height < 2.1 else 1.0)
        x = -0.44 * shape.length
        words = [
            (lettering(draw.rng), (x, z), high),
            (lettering(draw.rng, 8, 14), (x, z - 0.8 * high), 0.35 * high),
        ]
        letters = Letters(words, ink)
    heads = draw.option(range(HEADS))
    clad = draw.chance(family.clad)
    nose = shape.nose_z
    old = family.name == "old saloon"
    return Trim(
        colour=colour,
        roof=roof,
        low=draw.near(_PLASTIC, 4) if clad or not car or draw.chance(0.4) else tuple(0.8 * c for c in colour),
        panes=family.panes,
        doors=family.doors,
        head=1 if old else heads,
        tail=int(draw.any_of(family.tails)),
        grille=3 if old else draw.option(range(GRILLES)),
        head_z=(nose * draw.between(0.7, 0.76), nose * draw.between(0.9, 0.97)),
        plates=(
            None if draw.chance(0.06) else _WHITE_PLATE,
            _YELLOW_PLATE if draw.chance(0.12) else _WHITE_PLATE,
        ),
        tint=draw.near((36, 40, 44), 2),
        privacy=draw.between(0.45, 1.0),
        see_through=draw.between(0.2, 0.9),
        joined_panes=len(family.panes) > 1,
        bumper=draw.near((52, 53, 55), 5) if draw.chance(0.55 if not car else 0.05) or old else None,
        sill_m=draw.between(0.04, 0.14),
        head_m=draw.between(0.2, 0.42),
        crease=draw.between(0, 1),
        clad=clad,
        rubbing=draw.chance(0.3),
        chrome=draw.chance(0.25),
        handle=draw.any_of(((26, 26, 28), (196, 198, 200), tuple(0.92 * c for c in colour))),
        lit=draw.chance(0.3),
        head_lit=draw.chance(0.35),
        dirt=float(draw.rng.beta(1.2, 5)),
        sunroof=car and draw.chance(0.2),
        band=band,
        band_z=(0.8 * low_z, 1.5 * low_z),
        letters=letters,
        bed=(30, 30, 32) if family.name == "pickup" else None,
        rear_window=car or draw.chance(0.6),
        split_doors=not car and family.name != "people carrier",
    )
