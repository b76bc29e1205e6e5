"""Meshes of all that stands still in edition 2: ground, kerbs, houses, plants, furniture."""

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from dreamdrive.scene.level import upright
from dreamdrive.scene.street.layout import Layout, Prop
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.light.lamps import Lamps
from streetworld.edition2.light.textures import TextureLibrary
from streetworld.edition2.roads.ground import Ground2
from streetworld.edition2.roads.tiles import between
from streetworld.edition2.roadside import furniture
from streetworld.edition2.roadside.barriers import barrier
from streetworld.edition2.roadside.buildings import house
from streetworld.edition2.roadside.paints import Paints
from streetworld.edition2.roadside.plants import bush, tree
from streetworld.engine.ground import GroundMap
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh, plate, quads

_REACH_M = 900.0
_DETAIL = ((25.0, 2.2), (55.0, 0.8), (110.0, 0.3), (np.inf, 0.12))
"""Share of the leaves that are drawn up to some distances from the way of the car."""
_LAMP = 80.0
"""Linear intensity of a street lamp at a metre."""


@dataclass(frozen=True)
class Scenery:
    """The mesh of what stands still, and the lamps in it."""

    mesh: Mesh
    lamps: Lamps


def scenery(
    layout: Layout,
    ground: Ground2,
    materials_of_ground: tuple[int, int],
    materials: Materials,
    textures: TextureLibrary | None,
) -> Scenery:
    """What stands beside the road and the ground under it; the ground has a near and a far material."""
    rng = np.random.default_rng([layout.seed, 96])
    paints = Paints(materials, textures)
    kerb_m = float(rng.choice([0.03, 0.08, 0.12, 0.15]))
    meshes = [_ground(layout, ground, materials_of_ground, kerb_m), _kerbs(layout, paints, rng, kerb_m)]
    meshes += [house(building, paints) for building in layout.buildings]
    meshes += _props(layout, paints)
    meshes += [barrier(each, paints) for each in layout.barriers]
    meshes.append(_skyline(layout, paints, rng))
    warm = rng.random() < 0.6
    tint = np.array([1.0, 0.72, 0.4]) if warm else np.array([0.95, 0.97, 1.0])
    heads = [
        (upright((*p.at_m, p.yaw_rad)) @ [*furniture.lamp_head(p), 1.0])[:3]
        for p in layout.props
        if p.kind == "lamp"
    ]
    power = _LAMP * float(rng.uniform(0.5, 1.6))
    return Scenery(Mesh.joined(meshes), Lamps.street(heads, [power * tint for _ in heads]))


def _props(layout: Layout, paints: Paints) -> list[Mesh]:
    """Props at their places; equal ones are made once."""
    made: dict[tuple[str, float, int, float], Mesh] = {}
    way = shapely.LineString([(p.x_m, p.y_m) for p in layout.ego.track] * 2)
    found: list[Mesh] = []
    for prop in layout.props:
        away = way.distance(shapely.Point(prop.at_m))
        detail = next(share for reach, share in _DETAIL if away < reach)
        key = (prop.kind, prop.height_m, prop.look, detail)
        if key not in made:
            made[key] = _prop(prop, paints, layout.light.snow, detail)
        found.append(made[key].moved(upright((*prop.at_m, prop.yaw_rad))))
    return found


def _prop(prop: Prop, paints: Paints, snow: float, detail: float) -> Mesh:
    if prop.kind in ("tree", "bush"):
        return (tree if prop.kind == "tree" else bush)(prop, paints, snow, detail)
    build = {
        "lamp": furniture.lamp,
        "sign": furniture.sign,
        "mast": furniture.mast,
        "traffic_light": furniture.traffic_light,
        "bin": furniture.bin_,
        "cone": furniture.cone,
    }
    return build[prop.kind](prop, paints)


def _plates(shape: BaseGeometry, z_m: float, material: int, of: GroundMap) -> list[Mesh]:
    return [
        plate(part, z_m, material, of.corner_m, of.size_m)
        for part in shapely.get_parts(shape)
        if isinstance(part, shapely.Polygon) and part.area > 1e-3
    ]


def _ground(layout: Layout, ground: Ground2, materials: tuple[int, int], kerb_m: float) -> Mesh:
    """The level ground, with sidewalks: with the near picture where it reaches, else with the far one."""
    (x, y), (width, height) = ground.corner_m, ground.size_m
    near = shapely.box(x, y - height, x + width, y)
    middle = np.array([x + 0.5 * width, y - 0.5 * height])
    all_ = shapely.box(*(middle - _REACH_M), *(middle + _REACH_M))
    meshes = [
        *_plates(near, 0.0, materials[0], ground),
        *_plates(all_.difference(near), 0.0, materials[1], ground.far),
    ]
    for area in layout.areas:
        if area.kind == "sidewalk":
            shape = shapely.Polygon(area.polygon, area.holes).buffer(0)
            meshes += _plates(shape.intersection(near), kerb_m, materials[0], ground)
            meshes += _plates(shape.difference(near), kerb_m, materials[1], ground.far)
    return Mesh.joined(meshes)


def _kerbs(layout: Layout, paints: Paints, rng: np.random.Generator, kerb_m: float) -> Mesh:
    """The upright edges of sidewalks."""
    stone = paints.plain(("kerb",), Semantic.SIDEWALK, rng.uniform(90, 190) * np.array([1, 0.99, 0.96]))
    faces: list[np.ndarray] = []
    for area in layout.areas:
        if area.kind != "sidewalk":
            continue
        for ring in (area.polygon, *area.holes):
            here = np.array(ring)
            there = np.roll(here, -1, axis=0)
            low, top = np.zeros((len(here), 1)), np.full((len(here), 1), kerb_m)
            faces.append(
                np.stack(
                    [np.hstack(c) for c in ((here, low), (there, low), (there, top), (here, top))], axis=1
                )
            )
    if not faces:
        return Mesh.joined([])
    corners = np.concatenate(faces)
    length = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    return quads(corners, stone, np.stack([np.maximum(length / 2, 0.05), np.full(len(length), 0.1)], -1))


def _skyline(layout: Layout, paints: Paints, rng: np.random.Generator) -> Mesh:
    """Rings far away: woods, hills, roofs and towers, so that the horizon is not bare."""
    middle = np.array([layout.ego.track[0].x_m, layout.ego.track[0].y_m])
    meshes: list[Mesh] = []
    for distance in (rng.uniform(230, 330), rng.uniform(380, 520), rng.uniform(600, 850)):
        kind = str(rng.choice(["wood", "hill", "town", "none"], p=[0.38, 0.24, 0.22, 0.16]))
        if kind == "none":
            continue
        count = 240
        turn = np.linspace(0, 2 * np.pi, count + 1)
        smooth = _ring_noise(rng, count, 6) * 0.6 + _ring_noise(rng, count, 20) * 0.4
        fine = rng.uniform(0, 1, count)
        high = {
            "wood": np.maximum(0, 6 + 8 * smooth + 4 * fine),
            "hill": np.maximum(0, distance * (0.02 + 0.07 * smooth)) + 0.5 * fine,
            "town": np.where(
                _ring_noise(rng, count, 12) > -0.2,
                6 + 30 * np.repeat(rng.random(count // 3) ** 4, 3) + 4 * np.repeat(fine[::3], 3),
                0,
            ),
        }[kind]
        high = high * rng.uniform(0.5, 1.5)
        if kind == "town":
            colour, semantic = between(rng, (90, 90, 96), (200, 190, 180)), Semantic.BUILDING
        else:
            colour, semantic = between(rng, (46, 58, 34), (110, 116, 76)), Semantic.VEGETATION
        material = paints.plain(("far", kind), semantic, colour)
        flat = middle + distance * np.stack([np.cos(turn), np.sin(turn)], -1)
        shape = np.append(high, high[0])
        first, second = (shape[:-1], shape[:-1]) if kind == "town" else (shape[:-1], shape[1:])
        here, there = flat[:-1], flat[1:]
        low = np.full((count, 1), -30.0)
        corners = np.stack(
            [
                np.hstack([here, low]),
                np.hstack([there, low]),
                np.hstack([there, second[:, None]]),
                np.hstack([here, first[:, None]]),
            ],
            1,
        )
        meshes.append(quads(corners, material, np.full((count, 2), 3.0)))
    return Mesh.joined(meshes)


def _ring_noise(rng: np.random.Generator, count: int, knots: int) -> np.ndarray:
    """Smooth noise around a circle, about -1 to 1."""
    values = rng.normal(0, 0.6, knots)
    at = np.arange(count) / count * knots
    low = at.astype(int)
    share = 0.5 - 0.5 * np.cos(np.pi * (at - low))
    return values[low % knots] * (1 - share) + values[(low + 1) % knots] * share
