"""Pedestrians, who walk as they move."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.layouts.variants import Draw
from streetworld.edition2.people.figure import Clothes, dress, head, limb, trunk
from streetworld.edition2.vehicles.parts.body_materials import Coats
from streetworld.edition2.vehicles.parts.loft import bar, tube
from streetworld.engine.bodies import Part, Size
from streetworld.engine.materials import Materials
from streetworld.engine.mesh import Mesh, box

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
    coats = Coats(draw, Semantic.PEDESTRIAN, materials)
    clothes = dress(draw, coats, child)
    meshes = [trunk(height, clothes), head(draw, height, clothes)]
    meshes += _carried(draw, height, umbrella, clothes, coats)
    return [Part(Mesh.joined(meshes)), *_limbs(draw, height, clothes, umbrella > 0)]


@dataclass(frozen=True)
class _Gait:
    """How the limbs of one side move.

    Attributes:
        height_m: Of the person.
        girth: Of the trunk, 1 on average.
        side: 1 on the left, -1 on the right.
        swing_rad: Of the thighs.
        start_rad: Phase of the left side at the start.
        raised: Whether the arm is bent and still: with a telephone, an umbrella, in a pocket.
    """

    height_m: float
    girth: float
    side: float
    swing_rad: float
    start_rad: float
    raised: bool

    def _phase(self, way_m: float) -> float:
        turn = 2 * np.pi * way_m / (0.82 * self.height_m)
        return turn + self.start_rad + (np.pi if self.side < 0 else 0.0)

    def _thigh(self, way_m: float) -> float:
        return self.swing_rad * np.sin(self._phase(way_m)) + 0.04

    def hip(self, _: float) -> Float[np.ndarray, "3"]:
        """Place of the hip."""
        return np.array([0.0, self.side * 0.052 * self.height_m * self.girth, 0.5 * self.height_m])

    def knee(self, way_m: float) -> Float[np.ndarray, "3"]:
        """Place of the knee."""
        return self.hip(way_m) + 0.235 * self.height_m * _down(self._thigh(way_m))

    def ankle(self, way_m: float) -> Float[np.ndarray, "3"]:
        """Place of the ankle; the leg that swings ahead is bent."""
        fold = 0.08 + 1.1 * self.swing_rad * max(0.0, np.sin(self._phase(way_m) + 1.3))
        return self.knee(way_m) + 0.225 * self.height_m * _down(self._thigh(way_m) - fold)

    def shoulder(self, _: float) -> Float[np.ndarray, "3"]:
        """Place of the shoulder."""
        return np.array([0.0, self.side * 0.115 * self.height_m * self.girth, 0.8 * self.height_m])

    def _arm(self, way_m: float) -> float:
        return 0.25 if self.raised else -0.8 * self.swing_rad * np.sin(self._phase(way_m))

    def elbow(self, way_m: float) -> Float[np.ndarray, "3"]:
        """Place of the elbow."""
        out = np.array([0, 0.12 * self.side, 0])
        return self.shoulder(way_m) + 0.16 * self.height_m * (_down(self._arm(way_m)) + out)

    def hand(self, way_m: float) -> Float[np.ndarray, "3"]:
        """Place of the hand."""
        return self.elbow(way_m) + 0.16 * self.height_m * _down(
            self._arm(way_m) + (1.9 if self.raised else 0.35)
        )


def _down(angle_rad: float) -> Float[np.ndarray, "3"]:
    """Downwards, turned ahead by an angle."""
    return np.array([np.sin(angle_rad), 0.0, -np.cos(angle_rad)])


def _limbs(draw: Draw, height: float, clothes: Clothes, umbrella: bool) -> list[Part]:
    start, swing = float(draw.rng.uniform(0, 2 * np.pi)), draw.between(0.3, 0.55)
    swing *= {"robe": 0.5, "skirt": 0.75, "coat": 0.8}.get(clothes.outfit, 1.0)
    posed = draw.chance(0.25)
    wide = height * (0.5 + 0.5 * clothes.girth)
    thigh = clothes.top if clothes.outfit == "robe" else clothes.legs
    lower_arm = clothes.skin if clothes.outfit == "shorts" else clothes.top
    parts = []
    for side in (1.0, -1.0):
        raised = (umbrella and side > 0) or (posed and side < 0)
        gait = _Gait(height, clothes.girth, side, swing, start, raised)
        parts += [
            limb(gait.hip, gait.knee, (0.047 * wide, 0.034 * wide), thigh),
            limb(gait.knee, gait.ankle, (0.034 * wide, 0.024 * wide), clothes.legs, clothes.shoes),
            limb(gait.shoulder, gait.elbow, (0.031 * wide, 0.026 * wide), clothes.top),
            limb(gait.elbow, gait.hand, (0.025 * wide, 0.02 * wide), lower_arm),
        ]
    return parts


def _carried(draw: Draw, height: float, umbrella: float, clothes: Clothes, coats: Coats) -> list[Mesh]:
    """Backpack, bag, umbrella."""
    made = []
    back = 0.075 * height * clothes.girth
    if draw.chance(0.22):
        z = np.array([0.56, 0.57, 0.66, 0.77, 0.8])
        centres = np.stack([np.full(5, -back - 0.04 * height), np.zeros(5), z * height], axis=-1)
        radii = np.array([[0, 0], [0.05, 0.075], [0.055, 0.08], [0.045, 0.07], [0, 0]]) * height
        made.append(tube(centres, radii, coats.plain(draw.bright()), 10, 3.5))
    elif draw.chance(0.25):
        y = draw.any_of((-1.0, 1.0)) * 0.17 * height * clothes.girth
        size = (0.16 * height, 0.06 * height, 0.13 * height)
        made.append(box((0.0, y, 0.4 * height), size, coats.plain(draw.bright())))
        made.append(bar((0, y, 0.46 * height), (0, 0.6 * y, 0.8 * height), (0.008, 0.008), clothes.shoes))
    if umbrella:
        top, at = height + umbrella, np.array([0.12, 0.06, 0.0])
        radii = np.array([[0.48, 0.48], [0.36, 0.36], [0.2, 0.2], [0.0, 0.0]])
        centres = at + np.array([[0, 0, top - 0.22], [0, 0, top - 0.1], [0, 0, top - 0.03], [0, 0, top]])
        made.append(tube(centres, radii, coats.plain(draw.bright()), 10))
        made.append(bar((0.12, 0.06, 0.62 * height), (0.12, 0.06, top - 0.02), (0.012, 0.012), clothes.shoes))
    return made
