"""Riders of bicycles and motorcycles."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.level import pitched
from streetworld.edition2.layouts.variants import Draw
from streetworld.edition2.people.figure import Clothes, bent, head, limb, trunk
from streetworld.engine.bodies import Part
from streetworld.engine.mesh import Mesh

_ROLL_M = 0.8  # way of a bicycle while the cranks turn by a radian


def has_rider(look: int) -> bool:
    """Whether somebody rides a bicycle or motorcycle of this look; the others stand parked."""
    return look // 5 % 2 == 0


@dataclass(frozen=True)
class Seat:
    """Where a rider sits, holds on and steps.

    Attributes:
        hip, hand, pedal: Places along x and z; the pedal's is the middle of its circle.
        hand_wide: Distance of the hands from the middle.
        lean_rad: How far the trunk leans forward.
        crank_m: Radius of the pedals' circle, 0 for foot rests.
    """

    hip: tuple[float, float]
    hand: tuple[float, float]
    pedal: tuple[float, float]
    hand_wide: float
    lean_rad: float
    crank_m: float = 0.0


@dataclass(frozen=True)
class _Leg:
    """A leg from the hip to a foot that the pedal turns."""

    hip: Float[np.ndarray, "3"]
    side: float
    seat: Seat
    lengths_m: tuple[float, float]

    def foot(self, way_m: float) -> Float[np.ndarray, "3"]:
        """Where the pedal is."""
        turn = way_m / _ROLL_M + (np.pi if self.side < 0 else 0.0)
        x, z = self.seat.pedal
        crank = self.seat.crank_m
        return np.array([x + crank * np.sin(turn), self.side * 0.11, z + crank * np.cos(turn) + 0.06])

    def knee(self, way_m: float) -> Float[np.ndarray, "3"]:
        """Where the knee is then."""
        return bent(self.hip, self.foot(way_m), self.lengths_m, np.array([1.0, 0.12 * self.side, 0.35]))

    def ankle(self, way_m: float) -> Float[np.ndarray, "3"]:
        """Where the shank ends: at the pedal if it is long enough."""
        knee = self.knee(way_m)
        line = self.foot(way_m) - knee
        return knee + line * self.lengths_m[1] / max(float(np.linalg.norm(line)), 1e-9)


def rider(draw: Draw, seat: Seat, top_m: float, clothes: Clothes, helmet: int | None) -> list[Part]:
    """Somebody who sits, holds the bar and turns the pedals; the head reaches a height."""
    above = 0.5 * np.cos(seat.lean_rad) + 0.012
    height = float(np.clip((top_m - seat.hip[1]) / above, 0.9, 2.1))
    hip = np.array([seat.hip[0], 0.0, seat.hip[1] + 0.04])
    lean = pitched((0, 0, 0), seat.lean_rad)
    lean[:3, 3] = hip - lean[:3, :3] @ np.array([0, 0, 0.5 * height])
    if clothes.outfit in ("coat", "skirt", "robe"):
        clothes = replace(clothes, outfit="jacket")
    mesh = Mesh.joined([trunk(height, clothes), head(draw, height, clothes, helmet)]).moved(lean)
    raised = np.eye(4)
    raised[2, 3] = top_m - mesh.corners[..., 2].max()
    parts = [Part(mesh.moved(raised))]
    leg, arm = (0.25 * height, 0.245 * height), (0.165 * height, 0.17 * height)
    wide = height * (0.5 + 0.5 * clothes.girth)
    for side in (1.0, -1.0):
        steps = _Leg(hip + np.array([0.0, side * 0.055 * height, 0.0]), side, seat, leg)
        shoulder = (lean @ np.array([0, side * 0.11 * height * clothes.girth, 0.79 * height, 1.0]))[:3]
        hand = np.array([seat.hand[0], side * seat.hand_wide, seat.hand[1] + 0.02])
        elbow = bent(shoulder, hand, arm, np.array([-0.3, 0.35 * side, -0.8]))
        parts += [
            limb(lambda _, at=steps.hip: at, steps.knee, (0.05 * wide, 0.036 * wide), clothes.legs),
            limb(steps.knee, steps.ankle, (0.035 * wide, 0.025 * wide), clothes.legs, clothes.shoes),
            limb(
                lambda _, at=shoulder: at, lambda _, at=elbow: at, (0.033 * wide, 0.027 * wide), clothes.top
            ),
            limb(lambda _, at=elbow: at, lambda _, at=hand: at, (0.026 * wide, 0.021 * wide), clothes.top),
        ]
    return parts
