"""Lamps at night: street lamps and headlights, as light on surfaces."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from streetworld.engine.columns import dot, outer

_MOST = 28
"""Lamps that light one picture: the nearest ones."""
_BEAM_RAD = 0.32
"""Half width of a headlight's beam."""
_CUT_OFF = 0.02
"""Slope above the beam over which its light falls off."""


@dataclass(frozen=True)
class Lamps:
    """Points of light: places in the map, linear intensity at a metre by colour, and where beams point.

    ``ahead`` is 0 for a street lamp, which shines on all below it; ``beams`` says which are headlights.
    """

    at_m: Float[np.ndarray, "n 3"]
    colour: Float[np.ndarray, "n 3"]
    ahead: Float[np.ndarray, "n 2"]

    @staticmethod
    def street(at_m: list[np.ndarray], colour: list[np.ndarray]) -> "Lamps":
        """Lamps above the street."""
        count = len(at_m)
        at, light = (np.asarray(t, np.float32).reshape(count, 3) for t in (at_m, colour))
        return Lamps(at, light, np.zeros((count, 2), np.float32))

    @property
    def beams(self) -> np.ndarray:
        """Which are headlights (N,)."""
        return (self.ahead != 0).any(axis=1)

    def __len__(self) -> int:
        return len(self.at_m)

    def __add__(self, other: "Lamps") -> "Lamps":
        pairs = ((self.at_m, other.at_m), (self.colour, other.colour), (self.ahead, other.ahead))
        return Lamps(*(np.concatenate(pair).astype(np.float32) for pair in pairs))

    def nearest(self, place_m: Float[np.ndarray, "3"]) -> "Lamps":
        """Those that light a picture taken at a place."""
        order = np.argsort(np.linalg.norm(self.at_m - place_m, axis=1))[:_MOST]
        return Lamps(self.at_m[order], self.colour[order], self.ahead[order])

    def light(
        self, points: Float[np.ndarray, "n 3"], normal: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, "n 3"]:
        """Light on surfaces (N, 3); nothing is in its way."""
        total = np.zeros((len(points), 3), dtype=np.float32, order="F")
        for at, colour, ahead in zip(self.at_m, self.colour, self.ahead, strict=True):
            way = at - points
            square = dot(way, way)
            lit = np.maximum(dot(way, normal), 0) / np.sqrt(square)
            if ahead.any():
                along = -(way[:, 0] * ahead[0] + way[:, 1] * ahead[1])
                aside = np.abs(way[:, 0] * ahead[1] - way[:, 1] * ahead[0])
                reach = np.maximum(along, 0.1)
                rise = (-way[:, 2] / reach - 0.004) / _CUT_OFF
                lit *= np.exp(-((aside / reach / _BEAM_RAD) ** 2)) * (along > 0)
                lit *= 0.04 + 0.96 / (1 + np.exp(np.clip(rise, -30, 30)))
            else:
                lit *= np.maximum(way[:, 2], 0) / np.sqrt(square)
            total += outer(lit / (square + 6), colour)
        return total


def headlights(
    poses: list[tuple[np.ndarray, tuple[float, float, float]]], rng_seed: int, strength: float
) -> Lamps:
    """The beams of cars at their poses (map_from_body (4, 4), size): one lamp in the middle of each front."""
    at, colour, ahead = [], [], []
    for k, (pose, size) in enumerate(poses):
        rng = np.random.default_rng([rng_seed, 31, k])
        at.append(pose[:3, 3] + pose[:3, 0] * (0.5 * size[0] + 0.05) + [0, 0, 0.65])
        tint = np.array([1.0, 0.93, 0.8]) if rng.random() < 0.5 else np.array([0.92, 0.96, 1.0])
        colour.append(strength * rng.uniform(0.6, 1.4) * tint)
        ahead.append(pose[:2, 0])
    count = len(at)
    shaped = (np.asarray(t, np.float32).reshape(count, -1) for t in (at, colour, ahead))
    return Lamps(*shaped) if count else Lamps.street([], [])
