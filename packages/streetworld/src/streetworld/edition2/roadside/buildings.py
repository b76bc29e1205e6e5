"""Houses of edition 2: fronts, roofs of many kinds, chimneys, balconies, porches."""

import numpy as np
import shapely

from dreamdrive.scene.level import upright
from dreamdrive.scene.street.layout import Building
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.light.textures import recoloured
from streetworld.edition2.roads.tiles import between
from streetworld.edition2.roadside.facades import VARIANTS, facade
from streetworld.edition2.roadside.paints import Paints
from streetworld.engine import paint
from streetworld.engine.mesh import Mesh, box, plate, quads, walls

_CUT_SHARE = 0.6
_FLOOR_M = 3.05


def house(building: Building, paints: Paints) -> Mesh:
    """A house; equal looks of equal height have equal fronts and roofs."""
    rng = np.random.default_rng([building.look, 72])
    height = building.height_m
    floors = int(np.clip(round(height / _FLOOR_M), 1, 16))
    material, width_m, style = _front(building, floors, paints, rng)
    polygon = shapely.orient_polygons(shapely.Polygon(building.polygon))
    parts = [walls(building.polygon, (0.0, height), material, (width_m, height))]
    corners = np.array(polygon.exterior.coords)[:-1]
    pitched = len(corners) == 4 and floors <= 5 and style not in ("glass", "concrete") and rng.random() < 0.75
    if pitched:
        parts.append(_roof(corners, height, material, paints, rng, width_m))
    else:
        parts.append(_flat_roof(polygon, height, paints, rng))
    parts.append(_attached(corners, floors, paints, rng))
    return Mesh.joined(parts)


def _front(
    building: Building, floors: int, paints: Paints, rng: np.random.Generator
) -> tuple[int, float, str]:
    """Material of the walls, the width of its picture in metres and its style."""
    variant = int(rng.integers(VARIANTS))
    cut = paints.cut("facade", building.look, rng, _CUT_SHARE)
    if cut is not None:
        picture, width = cut
        stretch = building.height_m / max(2.5, picture.shape[0] / picture.shape[1] * width)
        if stretch > 1.7:  # a low picture is laid one above the other
            picture = np.concatenate([picture] * round(min(stretch, 5)), axis=0)
        glow = facade(variant, floors).glow
        key = ("cut", building.look, floors)
        return paints.get(key, Semantic.BUILDING, lambda: picture, glow=lambda: glow), width, "cut"
    made = facade(variant, floors)
    gloss = 0.12 if made.style == "glass" else 0.0
    tint = np.random.default_rng([building.look, 78])
    material = paints.get(
        ("front", building.look, floors),
        Semantic.BUILDING,
        lambda: recoloured(tint, made.image, 1.2),
        glow=lambda: made.glow,
        gloss=gloss,
    )
    return material, made.width_m, made.style


def _tiles_material(paints: Paints, rng: np.random.Generator) -> int:
    """Of a roof: clay, slate, metal, or felt."""
    colours = [
        (158, 84, 58),
        (120, 66, 50),
        (82, 82, 88),
        (60, 58, 60),
        (146, 132, 116),
        (96, 108, 100),
        (172, 174, 176),
    ]
    which = int(rng.integers(len(colours)))

    def make() -> paint.Image:
        local = np.random.default_rng([which, 73])
        image = paint.plain(local, 4.0, 4.0, colours[which]).astype(np.float32)
        image[:: int(local.integers(5, 12))] *= 0.75
        return paint.finished(image)

    return paints.get(("tiles", which), Semantic.BUILDING, make)


def _roof(
    corners: np.ndarray, height: float, wall: int, paints: Paints, rng: np.random.Generator, width_m: float
) -> Mesh:
    """A gable, hip or single-pitch roof over four walls, with eaves."""
    edges = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    if (edges[0] > edges[1]) == (rng.random() < 0.25):  # the ridge runs along the longer side, mostly
        corners = np.roll(corners, -1, axis=0)
    a, b, c, d = corners  # ridge from the middle of d-a to that of b-c
    rise = float(np.linalg.norm(b - c)) * 0.5 * rng.uniform(0.35, 1.1)
    rise = min(rise, 5.0)
    inset = rng.choice([0.0, 0.35], p=[0.65, 0.35])
    start, end = 0.5 * (a + d), 0.5 * (b + c)
    along = end - start
    start, end = start + inset * 0.7 * along, end - inset * 0.7 * along
    out = 1 + rng.uniform(0.0, 0.8) / max(float(np.linalg.norm(b - c)), 1.0)
    middle = corners.mean(axis=0)
    a2, b2, c2, d2 = (middle + out * (p - middle) for p in (a, b, c, d))
    drop = rise * (out - 1)
    low, top = height - drop, height + rise
    tiles = _tiles_material(paints, rng)

    def at(p: np.ndarray, z: float) -> np.ndarray:
        return np.array([p[0], p[1], z])

    if inset == 0:
        over = (out - 1) * 0.5
        start2, end2 = start - over * along, end + over * along
    else:
        start2, end2 = start, end
    s, e = at(start2, top), at(end2, top)
    sides = [
        [at(a2, low), at(b2, low), e, s],
        [at(c2, low), at(d2, low), s, e],
    ]
    span = max(1.0, float(np.linalg.norm(along)) / 4)
    mesh = quads(np.array(sides), tiles, np.array([[span, 1.5], [span, 1.5]]))
    ends = np.array([[at(b2, low), at(c2, low), e], [at(d2, low), at(a2, low), s]])
    if inset == 0:
        ends = np.array(
            [[at(b, height), at(c, height), at(end, top)], [at(d, height), at(a, height), at(start, top)]]
        )
    uv = np.tile(np.array([[0.1, 0.45], [0.9, 0.45], [0.5, 0.05]]), (2, 1, 1)) * [4 / width_m, 1]
    gables = Mesh(ends, uv, np.full(2, wall if inset == 0 else tiles))
    parts = [mesh, gables]
    if rng.random() < 0.5:
        spot = start + along * rng.uniform(0.2, 0.8)
        brick = paints.plain(("chimney",), Semantic.BUILDING, between(rng, (90, 60, 50), (200, 180, 170)))
        parts.append(box((*spot, top), (0.6, 0.5, 1.8), brick))
    return Mesh.joined(parts)


def _flat_roof(polygon: shapely.Polygon, height: float, paints: Paints, rng: np.random.Generator) -> Mesh:
    """A level roof, perhaps with a storey set back or a box on it."""
    slate = paints.plain(("flat",), Semantic.BUILDING, (112, 106, 102))
    parts = [plate(polygon, height, slate, (0, 0), (6.0, 6.0))]
    if rng.random() < 0.5:
        smaller = polygon.buffer(-rng.uniform(1.2, 3))
        if smaller.geom_type == "Polygon" and smaller.area > 6:
            rise = float(rng.uniform(1.5, 3.4))
            ring = list(smaller.exterior.coords)[:-1]
            colour = rng.uniform(70, 210) + rng.normal(0, 10, 3)
            paint_ = paints.plain(("attic",), Semantic.BUILDING, np.clip(colour, 0, 250))
            parts += [
                walls(ring, (height, height + rise), paint_, (3.0, 3.0)),
                plate(smaller, height + rise, slate, (0, 0), (6.0, 6.0)),
            ]
    return Mesh.joined(parts)


def _attached(corners: np.ndarray, floors: int, paints: Paints, rng: np.random.Generator) -> Mesh:
    """Balconies, a porch, an awning or steps on some of the walls."""
    parts: list[Mesh] = []
    kind = str(rng.choice(["none", "balconies", "porch", "awning", "steps"], p=[0.45, 0.2, 0.12, 0.15, 0.08]))
    if kind == "none":
        return Mesh.joined(parts)
    colour = rng.uniform(60, 235) * rng.uniform((0.8, 0.8, 0.75), 1.0)
    paint_ = paints.plain((kind,), Semantic.BUILDING, colour)
    for here, there in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        length = float(np.linalg.norm(there - here))
        if length < 5 or rng.random() < 0.3:
            continue
        along = (there - here) / length
        pose = upright((*(0.5 * (here + there)), float(np.arctan2(along[1], along[0]))))
        made: list[Mesh] = []  # x along the wall, -y out of it
        if kind == "balconies":
            wide, count = rng.uniform(2, 3.5), max(1, int(length / 5))
            for floor in range(1, floors):
                for k in range(count):
                    x = (k + 0.5) * length / count - 0.5 * length
                    made.append(box((x, -0.6, floor * _FLOOR_M), (wide, 1.2, 0.15), paint_))
                    made.append(box((x, -1.17, floor * _FLOOR_M + 0.5), (wide, 0.06, 0.9), paint_))
        elif kind == "porch":
            x = rng.uniform(-0.3, 0.3) * length
            made.append(box((x, -0.8, 2.6), (3.0, 1.6, 0.2), paint_))
            made += [box((x + s, -1.5, 1.25), (0.15, 0.15, 2.5), paint_) for s in (-1.4, 1.4)]
        elif kind == "awning":
            cloth = paints.plain(
                ("cloth",), Semantic.BUILDING, rng.uniform(40, 230) * np.array([1, 0.95, 0.88])
            )
            x0, x1 = -0.42 * length, 0.42 * length
            slope = [[x0, -1.3, 2.35], [x1, -1.3, 2.35], [x1, 0, 3.0], [x0, 0, 3.0]]
            made.append(quads(np.array([slope]), cloth))
        else:
            made += [box((0, -0.3 - 0.3 * k, 0.45 - 0.15 * k), (2, 0.6, 0.3), paint_) for k in range(3)]
        parts += [m.moved(pose) for m in made]
    return Mesh.joined(parts)
