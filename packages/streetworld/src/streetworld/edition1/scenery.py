"""Scenery beside the road: sidewalks, houses, trees, lamps, signs."""

from collections.abc import Callable

import numpy as np
import shapely

from dreamdrive.scene.level import upright
from dreamdrive.scene.street.layout import Building, Layout, Prop
from dreamdrive.scene.street.truth import Semantic
from streetworld.engine import paint
from streetworld.engine.ground import GroundMap
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh, ball, box, cylinder, plate, walls

KERB_M = 0.12
_REACH_M = 600.0
_FACADE_M = 11.0


def scenery(layout: Layout, ground: GroundMap, ground_material: int, materials: Materials) -> Mesh:
    """Everything of a layout that never moves, except its boxes."""
    lie = ground.corner_m, ground.size_m
    middle = np.array(ground.corner_m) + np.array(ground.size_m) * [0.5, -0.5]
    plain = shapely.box(*(middle - _REACH_M), *(middle + _REACH_M))
    meshes = [plate(plain, 0.0, ground_material, *lie)]
    rng = np.random.default_rng([layout.seed, 3])
    kerb = materials.add(paint.plain(rng, 2.0, 0.5, (150, 148, 142)), Semantic.SIDEWALK, repeats=True)
    for area in layout.areas:
        if area.kind != "sidewalk":
            continue
        meshes.append(plate(shapely.Polygon(area.polygon, area.holes), KERB_M, ground_material, *lie))
        meshes += [
            _kerb(ring, kerb, outer)
            for ring, outer in ((area.polygon, True), *((h, False) for h in area.holes))
        ]
    paints = _Paints(materials)
    build = {"tree": _tree, "lamp": _lamp, "sign": _sign}
    meshes += [_house(house, paints) for house in layout.buildings]
    meshes += [build[p.kind](p, paints).moved(upright((*p.at_m, p.yaw_rad))) for p in layout.props]
    return Mesh.joined(meshes)


class _Paints:
    """Materials of what stands beside the road, each of them painted once."""

    def __init__(self, materials: Materials) -> None:
        self._materials, self._made = materials, dict[tuple[str, int], int]()

    def get(self, name: str, look: int, kind: Semantic, make: Callable[[], paint.Image]) -> int:
        """Index of the material of a name and look."""
        if (name, look) not in self._made:
            self._made[name, look] = self._materials.add(make(), kind, repeats=True)
        return self._made[name, look]

    def steel(self) -> int:
        """That of posts."""
        grey = (98, 104, 106)
        return self.get(
            "steel", 0, Semantic.POLE, lambda: paint.plain(np.random.default_rng(8), 0.5, 2.0, grey)
        )


def _kerb(ring: list[tuple[float, float]], material: int, outer: bool) -> Mesh:
    """The upright edge of a sidewalk, facing away from it."""
    mesh = walls(ring, (0.0, KERB_M), material, (2.0, 0.5))
    return mesh if outer else Mesh(mesh.corners[:, ::-1], mesh.uv[:, ::-1], mesh.material)


def _house(house: Building, paints: _Paints) -> Mesh:
    """Walls with a facade for every look and height, and a flat roof."""
    height = round(house.height_m, 1)
    rng = np.random.default_rng([house.look, 4])
    facade = paints.get(
        f"house {height}", house.look, Semantic.BUILDING, lambda: paint.facade(rng, _FACADE_M, height)
    )
    slates = (112, 104, 100)
    slate = paints.get(
        "roof", 0, Semantic.BUILDING, lambda: paint.plain(np.random.default_rng(5), 6.0, 6.0, slates)
    )
    roof = plate(shapely.Polygon(house.polygon), house.height_m, slate, (0, 0), (6.0, 6.0))
    front = walls(house.polygon, (0.0, house.height_m), facade, (_FACADE_M, house.height_m))
    return Mesh.joined([front, roof])


def _tree(prop: Prop, paints: _Paints) -> Mesh:
    rng = np.random.default_rng([prop.look, 6])
    colour = tuple(rng.uniform((52, 78, 30), (112, 122, 60)))
    leaves = paints.get("leaves", prop.look, Semantic.VEGETATION, lambda: paint.leaves(rng, colour))
    bark = paints.get("bark", 0, Semantic.VEGETATION, lambda: paint.bark(np.random.default_rng(7)))
    height, wide = prop.height_m, prop.height_m * rng.uniform(0.22, 0.32)
    parts = [cylinder((0, 0, 0), (0, 0, 0.6 * height), (0.045 * height, 0.02 * height), bark, None, 8)]
    for _ in range(7):
        away, turn = wide * rng.uniform(0, 0.65), rng.uniform(0, 2 * np.pi)
        centre = (away * np.cos(turn), away * np.sin(turn), height * rng.uniform(0.5, 0.85))
        radius = wide * rng.uniform(0.45, 0.75)
        parts.append(ball(centre, (radius, radius, 0.8 * radius), leaves, 5, rng))
    return Mesh.joined(parts)


def _lamp(prop: Prop, paints: _Paints) -> Mesh:
    steel, top = paints.steel(), prop.height_m
    return Mesh.joined(
        [
            cylinder((0, 0, 0), (0, 0, top), (0.11, 0.06), steel, None, 8),
            cylinder((0, 0, top), (1.6, 0, top + 0.15), (0.05, 0.04), steel, None, 6),
            box((1.7, 0, top + 0.12), (0.6, 0.22, 0.12), steel),
        ]
    )


def _sign(prop: Prop, paints: _Paints) -> Mesh:
    steel, top, rng = paints.steel(), prop.height_m, np.random.default_rng([prop.look, 9])
    face = paints.get("sign", prop.look, Semantic.SIGN, lambda: paint.sign(rng))
    board = box((0.04, 0, top - 0.4), (0.04, 0.75, 0.75), [steel, steel, steel, face, steel, steel])
    return Mesh.joined([cylinder((0, 0, 0), (0, 0, top), (0.04, 0.04), steel, None, 6), board])
