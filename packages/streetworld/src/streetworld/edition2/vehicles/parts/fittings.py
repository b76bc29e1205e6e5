"""Fittings of a car or van: mirrors, racks, signs, light bars, loads, a spare wheel."""

from streetworld.edition2.layouts.variants import Colour, Draw
from streetworld.edition2.vehicles.family import Family
from streetworld.edition2.vehicles.parts.body_materials import Coats
from streetworld.edition2.vehicles.parts.loft import smooth
from streetworld.edition2.vehicles.shape import BodyShape
from streetworld.engine.mesh import Mesh, box, cylinder, frustum

TAXI: Colour = (236, 196, 44)
_DARK: Colour = (38, 39, 42)
_BLUE: Colour = (40, 70, 220)
_RED: Colour = (220, 30, 34)
_GLOSS = 0.03


class Fittings:
    """The fittings of a look.

    Attributes:
        role: Plain, taxi or police.
        on_roof_m: How far they reach above the roof.
    """

    def __init__(self, draw: Draw, family: Family) -> None:
        self._draw = draw
        pickup, at = family.name == "pickup", draw.rng.random()
        self.role = "plain"
        if draw.kind == "car" and not pickup:
            self.role = "taxi" if at < 0.06 else "police" if at < 0.085 else "plain"
        plain = self.role == "plain"
        self._rack = plain and not pickup and draw.chance(0.14)
        self._case = self._rack and draw.chance(0.25)
        self._load = pickup and draw.chance(0.4)
        self._spare = family.name == "off-roader" and draw.chance(0.5)
        self.on_roof_m = 0.3 if self._case else 0.11 if not plain else 0.05 if self._rack else 0.0

    def meshes(self, shape: BodyShape, paint: int, dark: int, coats: Coats) -> list[Mesh]:
        """Their triangles; ``paint`` is the material of the body from above, ``dark`` that from below."""
        made = [_mirror(shape, side, paint, dark) for side in (1.0, -1.0)]
        if self._rack:
            made += self._on_rack(shape, coats)
        if self.role == "taxi":
            x, roof, top = self._on_roof(shape)
            low, high = (x, x + 0.16, -0.28, 0.28), (x + 0.04, x + 0.12, -0.24, 0.24)
            made.append(frustum(low, high, (roof, top), [coats.plain(TAXI, _GLOSS)] * 6))
        if self.role == "police":
            x, roof, top = self._on_roof(shape)
            for y, colour in ((0.3, _BLUE), (-0.3, self._draw.any_of((_RED, _BLUE)))):
                at = (x + 0.1, y, 0.5 * (roof + top))
                made.append(box(at, (0.22, 0.56, top - roof), coats.plain(colour, _GLOSS)))
        if self._load:
            made += self._loads(shape, coats)
        if self._spare:
            back, z = -0.5 * shape.length, 0.62 * shape.cowl_z + 0.2
            cover = coats.plain(_DARK)
            made.append(cylinder((back + 0.1, 0, z), (back, 0, z), (0.34, 0.34), dark, cover, 14))
        return made

    def _on_roof(self, shape: BodyShape) -> tuple[float, float, float]:
        """Place along x of the middle of the roof, its height, and how high fittings reach."""
        middle = 0.5 * (shape.roof + shape.screen)
        return middle, shape.rail_at(middle) + 0.6 * shape.round_roof, shape.height + self.on_roof_m

    def _on_rack(self, shape: BodyShape, coats: Coats) -> list[Mesh]:
        x, roof, top = self._on_roof(shape)
        long, wide = 0.6 * (shape.screen - shape.roof), 2 * shape.roof_half()
        rail, z = coats.plain(_DARK), 0.5 * (roof + shape.height) + 0.04
        made = [box((x, y, roof + 0.03), (long, 0.035, 0.035), rail) for y in (-0.42 * wide, 0.42 * wide)]
        made += [box((x + a * long, 0, z), (0.05, 0.9 * wide, 0.03), rail) for a in (-0.3, 0.3)]
        if self._case:
            low, high = (x - 0.9, x + 0.7, -0.3, 0.3), (x - 0.8, x + 0.45, -0.25, 0.25)
            case = [coats.plain(self._draw.any_of((_DARK, (150, 152, 155))), _GLOSS)] * 6
            made.append(smooth(frustum(low, high, (shape.height, top), case), 1.0))
        return made

    def _loads(self, shape: BodyShape, coats: Coats) -> list[Mesh]:
        rng, made = self._draw.rng, []
        back, front = -0.5 * shape.length + 0.2, shape.deck - 0.2
        for _ in range(int(rng.integers(1, 5))):
            long, wide, high = (float(rng.uniform(*r)) for r in ((0.3, 0.9), (0.3, 1.0), (0.35, 0.8)))
            x = float(rng.uniform(back + 0.5 * long, front - 0.5 * long))
            y = float(rng.uniform(-0.4, 0.4)) * (shape.width - wide - 0.2)
            load = coats.plain(self._draw.muted())
            made.append(box((x, y, shape.tail_z - 0.25 + 0.5 * high), (long, wide, high), load))
        return made


def _mirror(shape: BodyShape, side: float, paint: int, dark: int) -> Mesh:
    x, z = shape.cowl - 0.11 * (shape.cowl - shape.deck) ** 0.5, shape.edge_at(shape.cowl) + 0.12
    near, far = side * (shape.foot_half() - 0.02), side * (0.5 * shape.width + 0.09)
    y0, y1 = min(near, far), max(near, far)
    low, high = (x - 0.06, x + 0.1, y0, y1), (x - 0.05, x + 0.05, y0, y1)
    return frustum(low, high, (z - 0.07, z + 0.08), (paint, paint, dark, paint, paint, dark))
