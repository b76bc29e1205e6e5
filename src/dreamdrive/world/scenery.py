"""What stands beside the road: sidewalks, houses, trees, lamps, signs."""

from collections.abc import Callable

import numpy as np
import shapely

from dreamdrive.scene.layout import Building, Layout, Prop
from dreamdrive.world import paint
from dreamdrive.world.ground import GroundMap
from dreamdrive.world.materials import Materials, Semantic
from dreamdrive.world.mesh import Mesh, ball, box, cylinder, place, plate, walls

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
    made: dict[tuple[str, int], int] = {}
    meshes += [_house(house, materials, made) for house in layout.buildings]
    meshes += [_prop(prop, materials, made) for prop in layout.props]
    return Mesh.joined(meshes)


def _kerb(ring: list[tuple[float, float]], material: int, outer: bool) -> Mesh:
    """The upright edge of a sidewalk, facing away from it."""
    mesh = walls(ring, (0.0, KERB_M), material, (2.0, 0.5))
    return mesh if outer else Mesh(mesh.corners[:, ::-1], mesh.uv[:, ::-1], mesh.material)


def _house(house: Building, materials: Materials, made: dict[tuple[str, int], int]) -> Mesh:
    """Walls with a facade for every look and height, and a flat roof."""
    height = round(house.height_m, 1)
    key = (f"house {height}", house.look)
    if key not in made:
        rng = np.random.default_rng([house.look, 4])
        made[key] = materials.add(paint.facade(rng, _FACADE_M, height), Semantic.BUILDING, repeats=True)
    if ("roof", 0) not in made:
        slates = paint.plain(np.random.default_rng(5), 6.0, 6.0, (112, 104, 100))
        made["roof", 0] = materials.add(slates, Semantic.BUILDING, repeats=True)
    roof = plate(shapely.Polygon(house.polygon), house.height_m, made["roof", 0], (0, 0), (6.0, 6.0))
    return Mesh.joined(
        [walls(house.polygon, (0.0, house.height_m), made[key], (_FACADE_M, house.height_m)), roof]
    )


def _prop(prop: Prop, materials: Materials, made: dict[tuple[str, int], int]) -> Mesh:
    build = {"tree": _tree, "lamp": _lamp, "sign": _sign}
    return build[prop.kind](prop, materials, made).moved(place(prop.at_m, prop.yaw_rad))


def _shared(
    made: dict[tuple[str, int], int],
    key: tuple[str, int],
    make: Callable[[], paint.Image],
    materials: Materials,
    kind: Semantic,
) -> int:
    """A material that is painted once."""
    if key not in made:
        made[key] = materials.add(make(), kind, repeats=True)
    return made[key]


def _tree(prop: Prop, materials: Materials, made: dict[tuple[str, int], int]) -> Mesh:
    rng = np.random.default_rng([prop.look, 6])
    colour = tuple(rng.uniform((52, 78, 30), (112, 122, 60)))
    leaves = _shared(
        made, ("leaves", prop.look), lambda: paint.leaves(rng, colour), materials, Semantic.VEGETATION
    )
    bark = _shared(
        made, ("bark", 0), lambda: paint.bark(np.random.default_rng(7)), materials, Semantic.VEGETATION
    )
    height, wide = prop.height_m, prop.height_m * rng.uniform(0.22, 0.32)
    parts = [cylinder((0, 0, 0), (0, 0, 0.6 * height), (0.045 * height, 0.02 * height), bark, None, 8)]
    for _ in range(7):
        away, turn = wide * rng.uniform(0, 0.65), rng.uniform(0, 2 * np.pi)
        centre = (away * np.cos(turn), away * np.sin(turn), height * rng.uniform(0.5, 0.85))
        radius = wide * rng.uniform(0.45, 0.75)
        parts.append(ball(centre, (radius, radius, 0.8 * radius), leaves, 5, rng))
    return Mesh.joined(parts)


def _steel(materials: Materials, made: dict[tuple[str, int], int]) -> int:
    grey = (98, 104, 106)
    return _shared(
        made,
        ("steel", 0),
        lambda: paint.plain(np.random.default_rng(8), 0.5, 2.0, grey),
        materials,
        Semantic.POLE,
    )


def _lamp(prop: Prop, materials: Materials, made: dict[tuple[str, int], int]) -> Mesh:
    steel = _steel(materials, made)
    top = prop.height_m
    return Mesh.joined(
        [
            cylinder((0, 0, 0), (0, 0, top), (0.11, 0.06), steel, None, 8),
            cylinder((0, 0, top), (1.6, 0, top + 0.15), (0.05, 0.04), steel, None, 6),
            box((1.7, 0, top + 0.12), (0.6, 0.22, 0.12), steel),
        ]
    )


def _sign(prop: Prop, materials: Materials, made: dict[tuple[str, int], int]) -> Mesh:
    steel = _steel(materials, made)
    face = _shared(
        made,
        ("sign", prop.look),
        lambda: paint.sign(np.random.default_rng([prop.look, 9])),
        materials,
        Semantic.SIGN,
    )
    top = prop.height_m
    board = box((0.04, 0, top - 0.4), (0.04, 0.75, 0.75), [steel, steel, steel, face, steel, steel])
    return Mesh.joined([cylinder((0, 0, 0), (0, 0, top), (0.04, 0.04), steel, None, 6), board])
