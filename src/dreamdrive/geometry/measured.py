"""Cameras and depth as a network or another program found them, in a unit of their own."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.scene.camera import Camera


def trusted(
    depth: Float[np.ndarray, "f h w"], trust: Float[np.ndarray, "f h w"], there: Bool[np.ndarray, "f h w"]
) -> tuple[Float[np.ndarray, "f h w"], Float[np.ndarray, "f h w"]]:
    """Depth where it is there, and as its confidence the share of that depth that is trusted less.

    ``trust`` grows with the network's trust, on any scale; elsewhere both are 0.
    """
    confidence = np.zeros(depth.shape, np.float32)
    confidence[there] = ranks(trust[there])
    return np.where(there, depth, 0).astype(np.float32), confidence


def ranks(values: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Share of all values that are at most this one, equal ones at their mean."""
    from scipy.stats import rankdata  # here: it takes half a second, and most runs have no network

    return rankdata(values).reshape(values.shape) / max(values.size, 1)


def weighted_median(values: Float[np.ndarray, " n"], weights: Float[np.ndarray, " n"]) -> float:
    """The lowest value with half of the weight at or below it; NaN where nothing weighs.

    NaN values count as absent.
    """
    counts = ~np.isnan(values) & (weights > 0)
    values, weights = values[counts], weights[counts]
    if not len(values):
        return float("nan")
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weights[order], dtype=np.float64)
    return float(values[order][np.searchsorted(below, below[-1] / 2)])


@dataclass(frozen=True)
class Measured:
    """What is measured of a clip before it is brought to metres and told what is road, sky and traffic.

    Attributes:
        world_from_camera: Poses (F, 4, 4) in any world.
        camera: Pinhole of the clip's size.
        focal_observed: Whether the focal length is calibrated or was seen, rather than assumed.
        depth: Depth along z (F, H, W) in the unit of the poses; 0 where there is none.
        confidence: Trust in it (F, H, W) in [0, 1].
        unit: What says that the unit is the metre, in words; None where nothing does.
        unit_spread: How far that metre may be off, as a fraction.
        others: What else tells metres, by its source: its metres in the unit of the poses.
        focal_spread: How far the focal length may be off, as a fraction; None where nothing tells: then not
            at all if observed, and as far as any assumed one if not.
        notes: What was noticed, a sentence each.
        details: Figures for the report, as JSON values.
    """

    world_from_camera: Float[np.ndarray, "f 4 4"]
    camera: Camera
    focal_observed: bool
    depth: Float[np.ndarray, "f h w"]
    confidence: Float[np.ndarray, "f h w"]
    unit: str | None = None
    unit_spread: float = 0.0
    others: dict[str, float] = field(default_factory=dict)
    focal_spread: float | None = None
    notes: tuple[str, ...] = ()
    details: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        size = self.camera.height_px, self.camera.width_px
        shape = (len(self.world_from_camera), *size)
        for name in ("depth", "confidence"):
            if getattr(self, name).shape != shape:
                raise ValueError(f"measured: {name} has the shape {getattr(self, name).shape}, not {shape}")
