"""Pedestrians, who walk as they move."""

import numpy as np

from dreamdrive.world import paint
from dreamdrive.world.bodies import Part, Size
from dreamdrive.world.edition2.draw import Draw
from dreamdrive.world.edition2.figure import Clothes, dress, head, limb, trunk
from dreamdrive.world.edition2.loft import tube
from dreamdrive.world.materials import Materials, Semantic
from dreamdrive.world.mesh import Mesh, box, cylinder

_UMBRELLA_M = 0.28


def pedestrian_size(look: int) -> Size:
    """Length, width and height of a look."""
    height, _, umbrella = _stature(Draw("pedestrian", look))
    wide = 0.3 * height + 0.05 if not umbrella else 0.95
    return wide, wide, height + umbrella


def _stature(draw: Draw) -> tuple[float, bool, float]:
    """Height, whether it is a child, and the height of an umbrella above."""
    child = draw.chance(0.12)
    height = draw.between(1.0, 1.45) if child else float(np.clip(draw.rng.normal(1.7, 0.09), 1.45, 1.98))
    return height, child, _UMBRELLA_M if not child and draw.chance(0.06) else 0.0


def pedestrian(size_m: Size, look: int, materials: Materials) -> list[Part]:
    """Somebody on foot."""
    draw = Draw("pedestrian", look)
    _, child, umbrella = _stature(draw)
    height = size_m[2] - umbrella
    clothes = dress(draw, Semantic.PEDESTRIAN, materials, child)
    meshes = [trunk(height, clothes), head(draw, height, clothes)]
    meshes += _carried(draw, height, umbrella, clothes, materials)
    return [Part(Mesh.joined(meshes)), *_limbs(draw, height, clothes, umbrella > 0)]


def _limbs(draw: Draw, height: float, clothes: Clothes, umbrella: bool) -> list[Part]:
    stride, start = 0.82 * height, float(draw.rng.uniform(0, 2 * np.pi))
    swing = draw.between(0.3, 0.55)
    posed = draw.chance(0.25)  # arms that do not swing: in pockets, or with a telephone
    parts = []
    for side in (1.0, -1.0):
        hip = np.array([0.0, side * 0.052 * height * clothes.girth, 0.5 * height])
        shoulder = np.array([0.0, side * 0.115 * height * clothes.girth, 0.8 * height])

        def phase(way_m: float, side: float = side) -> float:
            return 2 * np.pi * way_m / stride + start + (np.pi if side < 0 else 0.0)

        def thigh(way_m: float, phase=phase) -> float:
            return swing * np.sin(phase(way_m)) + 0.04

        def knee(way_m: float, hip=hip, thigh=thigh) -> np.ndarray:
            return hip + 0.235 * height * _down(thigh(way_m))

        def ankle(way_m: float, thigh=thigh, knee=knee, phase=phase) -> np.ndarray:
            fold = 0.08 + 1.1 * swing * max(0.0, np.sin(phase(way_m) + 1.3))
            return knee(way_m) + 0.225 * height * _down(thigh(way_m) - fold)

        raised = (umbrella and side > 0) or (posed and side < 0)

        def arm(way_m: float, phase=phase, raised=raised) -> float:
            return 0.25 if raised else -0.8 * swing * np.sin(phase(way_m))

        def elbow(way_m: float, shoulder=shoulder, arm=arm, side=side) -> np.ndarray:
            return shoulder + 0.16 * height * (_down(arm(way_m)) + np.array([0, 0.12 * side, 0]))

        def hand(way_m: float, elbow=elbow, arm=arm, raised=raised) -> np.ndarray:
            return elbow(way_m) + 0.16 * height * _down(arm(way_m) + (1.9 if raised else 0.35))

        wide = height * (0.5 + 0.5 * clothes.girth)
        bare = clothes.outfit == "shorts"
        parts += [
            limb(
                lambda _, hip=hip: hip,
                knee,
                (0.047 * wide, 0.034 * wide),
                clothes.top if clothes.outfit == "robe" else clothes.legs,
            ),
            limb(knee, ankle, (0.034 * wide, 0.024 * wide), clothes.legs, clothes.shoes),
            limb(lambda _, at=shoulder: at, elbow, (0.031 * wide, 0.026 * wide), clothes.top),
            limb(elbow, hand, (0.025 * wide, 0.02 * wide), clothes.skin if bare else clothes.top),
        ]
    return parts


def _down(angle_rad: float) -> np.ndarray:
    """Downwards, turned ahead by an angle."""
    return np.array([np.sin(angle_rad), 0.0, -np.cos(angle_rad)])


def _carried(
    draw: Draw, height: float, umbrella: float, clothes: Clothes, materials: Materials
) -> list[Mesh]:
    """Backpack, bag, umbrella."""

    def plain() -> int:
        return materials.add(paint.panel(draw.rng, draw.bright()), Semantic.PEDESTRIAN)

    made = []
    back = 0.075 * height * clothes.girth
    if draw.chance(0.22):
        z = np.array([0.56, 0.57, 0.66, 0.77, 0.8])
        centres = np.stack([np.full(5, -back - 0.04 * height), np.zeros(5), z * height], axis=-1)
        radii = np.array([[0, 0], [0.05, 0.075], [0.055, 0.08], [0.045, 0.07], [0, 0]]) * height
        made.append(tube(centres, radii, plain(), 10, 3.5))
    elif draw.chance(0.25):
        side = draw.any_of((-1.0, 1.0))
        at = (0.0, side * 0.17 * height * clothes.girth, 0.4 * height)
        made.append(box(at, (0.16 * height, 0.06 * height, 0.13 * height), plain()))
        made.append(
            cylinder(
                (0, at[1], 0.46 * height),
                (0, 0.6 * at[1], 0.8 * height),
                (0.008, 0.008),
                clothes.shoes,
                None,
                4,
            )
        )
    if umbrella:
        top = height + umbrella
        at = np.array([0.12, 0.06, 0.0])
        turn = np.array([[0.48, 0.48], [0.36, 0.36], [0.2, 0.2], [0.0, 0.0]])
        centres = np.array([[0, 0, top - 0.22], [0, 0, top - 0.1], [0, 0, top - 0.03], [0, 0, top]]) + at
        made.append(tube(centres, turn, plain(), 10))
        made.append(
            cylinder((*at[:2], 0.62 * height), (*at[:2], top - 0.02), (0.012, 0.012), clothes.shoes, None, 5)
        )
    return made
