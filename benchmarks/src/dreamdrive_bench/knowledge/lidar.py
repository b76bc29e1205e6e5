"""Depth and classes of pictures against lidar points."""

from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive_bench.knowledge.shots import Shot
from dreamdrive_bench.recorded.lidar import FAR_M, NEAR_M, PEOPLE, VEHICLES, labels

LEAST_POINTS = 20
"""Points of vehicles that a picture needs for a figure of its own."""
_BACKDROP_M = 40.0

Seen = tuple[Float[np.ndarray, "h w"], UInt8[np.ndarray, "h w"] | None]
"""Depth along z up to scale, 0 where there is none, and classes."""


@dataclass
class Found:
    """How many points of a kind were found, missed and imagined."""

    found: int = 0
    missed: int = 0
    imagined: int = 0

    def add(self, truth: Bool[np.ndarray, " n"], seen: Bool[np.ndarray, " n"]) -> None:
        """Count the points of one picture."""
        self.found += int((truth & seen).sum())
        self.missed += int((truth & ~seen).sum())
        self.imagined += int((~truth & seen).sum())

    def figures(self) -> dict[str, Any]:
        """Intersection over union, recall and precision; None without a point."""

        def share(of: int) -> float | None:
            return self.found / of if of else None

        return {
            "points": self.found + self.missed,
            "iou": share(self.found + self.missed + self.imagined),
            "recall": share(self.found + self.missed),
            "precision": share(self.found + self.imagined),
        }


@dataclass
class _Sums:
    depth: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    vehicle_depth: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    vehicles: Found = field(default_factory=Found)
    people: Found = field(default_factory=Found)
    classified: bool = False


def judge(shots: Iterable[Shot], see: Callable[[Shot], Seen]) -> dict[str, Any]:
    """Mean relative error of depth, up to a factor a picture, and which points of road users are found.

    Errors are means over pictures, then over cameras; points are pooled.
    """
    sums = _Sums()
    vehicle, person = labels(VEHICLES), labels(PEOPLE)
    for shot in shots:
        depth, classes = see(shot)
        at = shot.pixels()
        near = (shot.depth_m >= NEAR_M) & (shot.depth_m <= FAR_M)
        errors = relative_errors(depth[at], shot.depth_m, near)
        sums.depth[shot.camera].append(float(errors[near].mean()))
        if shot.label is None:
            continue
        of_vehicle = np.isin(shot.label, list(vehicle))
        if (near & of_vehicle).sum() >= LEAST_POINTS:
            sums.vehicle_depth[shot.camera].append(float(errors[near & of_vehicle].mean()))
        if classes is not None:
            sums.classified = True
            seen = classes[at][near]
            sums.vehicles.add(of_vehicle[near], seen == StreetClass.VEHICLE)
            riding = np.isin(seen, (StreetClass.PERSON, StreetClass.TWO_WHEELER))
            sums.people.add(np.isin(shot.label, list(person))[near], riding)
    return {
        "pictures": sum(map(len, sums.depth.values())),
        "abs_rel": _mean(sums.depth),
        "abs_rel_of_cameras": _means(sums.depth),
        "vehicle_abs_rel": _mean(sums.vehicle_depth),
        "vehicle_abs_rel_of_cameras": _means(sums.vehicle_depth),
        **(
            {}
            if not sums.classified
            else {
                "vehicles": sums.vehicles.figures(),
                "people_and_two_wheelers": sums.people.figures(),
            }
        ),
    }


def relative_errors(
    depth: Float[np.ndarray, " n"], true_m: Float[np.ndarray, " n"], counted: Bool[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Relative errors after one factor, the median ratio over what counts; no depth is as far as it gets."""
    known = counted & (depth > 0)
    factor = np.median(true_m[known] / depth[known]) if known.any() else 1.0
    scaled = np.where(depth > 0, depth * factor, FAR_M).clip(NEAR_M, FAR_M)
    return np.abs(scaled - true_m) / true_m


def plane_and_backdrop(shot: Shot) -> Seen:
    """A level road below the known camera, and a wall 40 m away: what geometry falls back to."""
    ground = Ground(np.array([0.0, -1.0, 0.0]), shot.height_m)
    return np.minimum(ground.depth_m(shot.pinhole), _BACKDROP_M), None


def _means(values: dict[str, list[float]]) -> dict[str, float]:
    return {camera: float(np.mean(each)) for camera, each in values.items()}


def _mean(values: dict[str, list[float]]) -> float | None:
    return float(np.mean(list(_means(values).values()))) if values else None
