"""Trajectory optimisation: a plan moved out of the way, with the car's shape and limits.

UniAD's optimisation (``plan.uniad``) moves each of six points away from what is near it, whatever the others
do. Here a car is moved: what is varied is how it brakes or speeds up along its planned path, and how far
beside it it drives. Such a drive costs what it deviates, how near the car's rectangle comes to what stands in
the way, and how hard it brakes. What a car cannot do is left out. All drives of a grid are weighed at once,
and then finer ones around the best.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline
from scipy.spatial import KDTree

from dreamdrive.drive import CELL_M
from dreamdrive.tasks.plan.cost import AGENT_DRIVER, CollisionOptions
from dreamdrive.tasks.plan.footprint import CAR, Footprint
from dreamdrive.tasks.plan.grid import GRID, Occupancy
from dreamdrive.tasks.plan.trajectory import Plan
from dreamdrive.tasks.plan.uniad import optimise_as_uniad

_FINE_S = 0.1
_MOST_CURVED_PER_M = 0.2  # a turning circle of 10 m
_LONGER_M = 30.0
_STANDING_M = 1e-3
_SWERVE_S, _SWERVE_LEAST_M = 2.0, 8.0
"""A swerve takes as long as the car drives in this time, and at least so far."""
_FAR_M = 10.0
_LOOK_M = 1.0


_Cells = Float[np.ndarray, "3 _"]
"""Middles of cells as x, y and 1, to be multiplied with lines."""


@dataclass(frozen=True)
class AvoidOptions:
    """What a drive costs, and what a car can do.

    Attributes:
        clear_m: Wanted distance of the car's rectangle from what stands in the way.
        unsure_m_s: By how much it grows a second, as nobody knows what others will do.
        unsure_ahead_m_s: By how much the car is taken to be longer ahead each second, as others may brake;
            never by more than it has driven.
        clear_weight: Cost of a metre short of it, squared.
        hit_cost: Of each time at which the rectangle touches a cell: more than any other drive.
        comfort_weight: Of a metre per second squared more or less than planned, squared.
        aside_weight: Of a metre beside the planned path, squared, against one along it.
        most_braking_m_s2: Hardest braking.
        most_gain_m_s2: Hardest speeding up beyond what is planned.
        most_lateral_m_s2: Hardest steering.
        most_aside_m: Farthest beside the planned path.
        near_m: Cells farther from the planned path than this are left out.
        footprint: The car.
    """

    clear_m: float = 0.4
    unsure_m_s: float = 0.1
    unsure_ahead_m_s: float = 1.0
    clear_weight: float = 20.0
    hit_cost: float = 10_000.0
    comfort_weight: float = 0.05
    aside_weight: float = 1.0
    most_braking_m_s2: float = 7.0
    most_gain_m_s2: float = 1.5
    most_lateral_m_s2: float = 4.0
    most_aside_m: float = 2.5
    near_m: float = 5.5
    footprint: Footprint = CAR


@dataclass(frozen=True)
class Avoided:
    """A plan, whether it was changed, and the least distance to what stands in the way before and after."""

    plan: Plan
    changed: bool
    clear_before_m: float
    clear_after_m: float


@dataclass(frozen=True)
class _Drives:
    """K drives at S times: the reference point, where the car points, how far it has come; whether it can."""

    places_m: Float[np.ndarray, "k s 2"]
    ahead: Float[np.ndarray, "k s 2"]
    driven_m: Float[np.ndarray, "k s"]
    feasible: Bool[np.ndarray, " k"]

    def feasible_ones(self) -> "_Drives":
        """Without what a car cannot do."""
        return _Drives(*(getattr(self, each.name)[self.feasible] for each in fields(self)))


def avoid(
    plan: Plan,
    speed_m_s: float,
    obstacles_m: Sequence[Float[np.ndarray, "_ 2"]],
    options: AvoidOptions = AvoidOptions(),
) -> Avoided:
    """The best drive near a planned one; the same one where it touches nothing, even with a car longer ahead.

    A planned drive that touches nothing is moved for room ahead alone, and never into what is in the way.

    Args:
        plan: What is planned.
        speed_m_s: Of the car now.
        obstacles_m: Middles of cells that are taken, in the planning frame, at times spread evenly up to the
            last waypoint: one or several for each.
        options: What a drive costs.
    """
    every, rest = divmod(len(obstacles_m), len(plan))
    if rest or not every:
        raise ValueError(
            f"obstacles at {len(obstacles_m)} times for {len(plan)} waypoints; expected a multiple"
        )
    path = _Path.of(plan, every, speed_m_s)
    near, taken = _near(obstacles_m, path, options), [_cells(each) for each in obstacles_m]
    planned = path.drives(np.zeros(1), np.zeros(1), options)
    before_m = float(_clearance(planned, taken, options.footprint).min())
    if (_clearance(planned, near, options.footprint, _longer(planned, path, options)) >= 0).all():
        return Avoided(plan, False, before_m, before_m)
    changes = np.linspace(-options.most_braking_m_s2, options.most_gain_m_s2, 13)
    asides = np.linspace(-options.most_aside_m, options.most_aside_m, 11)
    widths = changes[1] - changes[0], asides[1] - asides[0]
    change, aside = _best(path, planned, np.append(changes, 0.0), asides, near, options)
    for finer in (3, 9):
        tried = (
            around + width / finer * np.arange(-2, 3)
            for around, width in zip((change, aside), widths, strict=True)
        )
        change, aside = _best(path, planned, *tried, near, options)
    drive = path.drives(np.array([change]), np.array([aside]), options)
    waypoints_m = drive.places_m[0, every - 1 :: every]
    after_m = float(_clearance(drive, taken, options.footprint).min())
    if after_m < 0 <= before_m:
        return Avoided(plan, False, before_m, before_m)
    return Avoided(replace(plan, waypoints_m=waypoints_m), True, before_m, after_m)


def avoid_as_uniad(
    plan: Plan,
    speed_m_s: float,
    obstacles_m: Sequence[Float[np.ndarray, "_ 2"]],
    options: CollisionOptions = AGENT_DRIVER,
) -> Avoided:
    """The same by UniAD's optimisation, with the values and the condition of Agent-Driver.

    Distances are measured as in ``avoid``. Taken are the cells of the planning grid in which a point lies.
    """
    every = len(obstacles_m) // len(plan)
    rasters = [GRID.taken(cells) for cells in obstacles_m[every - 1 :: every]]
    occupied = Occupancy(np.stack([rasters[0], *rasters]), GRID, plan.step_s)
    moved = optimise_as_uniad(plan.waypoints_m[None], [occupied], options, plan.step_s)
    after = replace(plan, waypoints_m=moved.waypoints_m[0])
    before_m, after_m = (clearance(each, speed_m_s, obstacles_m, options.footprint) for each in (plan, after))
    return Avoided(after, bool(moved.chosen[0]), before_m, after_m)


def clearance(
    plan: Plan,
    speed_m_s: float,
    obstacles_m: Sequence[Float[np.ndarray, "_ 2"]],
    footprint: Footprint = CAR,
) -> float:
    """Least signed distance of the car from cells that are taken, see ``avoid``; at most 10 m."""
    options = AvoidOptions(footprint=footprint)
    path = _Path.of(plan, len(obstacles_m) // len(plan), speed_m_s)
    taken = [_cells(each) for each in obstacles_m]
    return float(_clearance(path.drives(np.zeros(1), np.zeros(1), options), taken, footprint).min())


@dataclass(frozen=True)
class _Path:
    """A planned path by the distance along it, and where on it the car is planned to be."""

    along_m: Float[np.ndarray, " n"]
    places_m: Float[np.ndarray, "n 2"]
    tangents: Float[np.ndarray, "n 2"]
    fine_s: Float[np.ndarray, " f"]
    planned_m_s: Float[np.ndarray, " f"]
    every: int
    swerve_m: float

    @staticmethod
    def of(plan: Plan, looks: int, speed_m_s: float) -> "_Path":
        """A smooth curve from where the car is through the waypoints, and straight on behind them.

        ``looks`` is how often between two waypoints the car is looked at.
        """
        every = max(1, round(plan.step_s / looks / _FINE_S))
        fine_s = np.arange(len(plan) * looks * every + 1) * (plan.step_s / looks / every)
        known = np.vstack([np.zeros((1, 2)), plan.waypoints_m])
        ends: Any = ((1, np.array([0.0, speed_m_s])), (2, np.zeros(2)))
        places = CubicSpline(np.concatenate([[0.0], plan.times_s]), known, bc_type=ends)(fine_s)
        steps_m = np.linalg.norm(np.diff(places, axis=0), axis=1)
        planned_m = np.concatenate([[0.0], np.cumsum(steps_m)])
        moves = np.concatenate([[True], steps_m > _STANDING_M])
        along_m, places = planned_m[moves], places[moves]
        ahead = np.array([0.0, 1.0]) if len(places) < 2 else places[-1] - places[-2]
        beyond = places[-1] + _LONGER_M * ahead / np.linalg.norm(ahead)
        along_m, places = np.append(along_m, along_m[-1] + _LONGER_M), np.vstack([places, beyond])
        return _Path(
            along_m,
            places,
            np.gradient(places, along_m, axis=0),
            fine_s,
            np.gradient(planned_m, float(fine_s[1])),
            every,
            max(_SWERVE_S * speed_m_s, _SWERVE_LEAST_M),
        )

    def drives(
        self,
        change_m_s2: Float[np.ndarray, " k"],
        aside_m: Float[np.ndarray, " k"],
        options: AvoidOptions,
    ) -> _Drives:
        """Drives along it with other accelerations and beside it."""
        step_s = float(self.fine_s[1])
        speed_m_s = np.maximum(self.planned_m_s + change_m_s2[:, None] * self.fine_s, 0.0)
        driven_m = (
            np.concatenate(
                [
                    np.zeros((len(speed_m_s), 1)),
                    np.cumsum(0.5 * (speed_m_s[:, 1:] + speed_m_s[:, :-1]), axis=1),
                ],
                axis=1,
            )
            * step_s
        )
        places, ahead = (
            np.stack([np.interp(driven_m, self.along_m, column) for column in rows.T], axis=-1)
            for rows in (self.places_m, self.tangents)
        )
        ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
        right = np.stack([ahead[..., 1], -ahead[..., 0]], axis=-1)
        share = np.clip(driven_m / self.swerve_m, 0.0, 1.0)
        aside = aside_m[:, None] * share**2 * (3 - 2 * share)
        slope = aside_m[:, None] * 6 * share * (1 - share) / self.swerve_m
        places = places + aside[..., None] * right
        ahead = ahead + slope[..., None] * right
        ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
        return _Drives(
            places[:, self.every :: self.every],
            ahead[:, self.every :: self.every],
            driven_m[:, self.every :: self.every],
            _feasible(ahead, driven_m, speed_m_s, step_s, options),
        )


def _feasible(
    ahead: Float[np.ndarray, "k f 2"],
    driven_m: Float[np.ndarray, "k f"],
    speed_m_s: Float[np.ndarray, "k f"],
    step_s: float,
    options: AvoidOptions,
) -> Bool[np.ndarray, " k"]:
    """Whether a car can steer so: neither too far at once, nor too fast."""
    turned = ahead[:, :-1, 0] * ahead[:, 1:, 1] - ahead[:, :-1, 1] * ahead[:, 1:, 0]
    lateral_m_s2 = np.abs(turned) / step_s * 0.5 * (speed_m_s[:, 1:] + speed_m_s[:, :-1])
    curved = np.abs(turned) > _MOST_CURVED_PER_M * np.diff(driven_m, axis=1) + 1e-6
    return np.asarray(~(curved | (lateral_m_s2 > options.most_lateral_m_s2)).any(axis=1))


def _best(
    path: _Path,
    planned: _Drives,
    changes_m_s2: Float[np.ndarray, " a"],
    asides_m: Float[np.ndarray, " b"],
    near: Sequence[_Cells],
    options: AvoidOptions,
) -> tuple[float, float]:
    """The change of acceleration and the way aside that cost least, of all pairs."""
    pairs = np.stack(np.meshgrid(changes_m_s2, asides_m, indexing="ij"), axis=-1).reshape(-1, 2)
    drives = path.drives(pairs[:, 0], pairs[:, 1], options)
    if drives.feasible.any():
        pairs, drives = pairs[drives.feasible], drives.feasible_ones()
    moved_m = drives.places_m - planned.places_m
    right = np.stack([planned.ahead[..., 1], -planned.ahead[..., 0]], axis=-1)
    along, aside = (moved_m * planned.ahead).sum(-1), (moved_m * right).sum(-1)
    clear_m = _clearance(drives, near, options.footprint, _longer(drives, path, options))
    short_m = np.maximum(_wanted(path, options) - clear_m, 0.0)
    cost = (along**2 + options.aside_weight * aside**2).sum(1)
    cost += (options.clear_weight * short_m**2 + options.hit_cost * (clear_m < 0)).sum(1)
    cost += options.comfort_weight * clear_m.shape[1] * pairs[:, 0] ** 2
    row = int(cost.argmin())
    return float(pairs[row, 0]), float(pairs[row, 1])


def _wanted(path: _Path, options: AvoidOptions) -> Float[np.ndarray, " s"]:
    return options.clear_m + options.unsure_m_s * path.fine_s[path.every :: path.every]


def _longer(drives: _Drives, path: _Path, options: AvoidOptions) -> Float[np.ndarray, "k s"]:
    return np.minimum(options.unsure_ahead_m_s * path.fine_s[path.every :: path.every], drives.driven_m)


def _near(
    obstacles_m: Sequence[Float[np.ndarray, "_ 2"]], path: _Path, options: AvoidOptions
) -> list[_Cells]:
    """Cells that any drive could come near to by the time at which they are taken."""
    extremes = np.array([-options.most_braking_m_s2, options.most_gain_m_s2])
    drives = path.drives(extremes, np.zeros(2), options)
    first_m, last_m = drives.driven_m - options.near_m
    last_m = last_m + 2 * options.near_m + _longer(drives, path, options)[1]
    stations = np.arange(0.0, drives.driven_m[1, -1] + _LOOK_M, _LOOK_M)
    line = np.stack([np.interp(stations, path.along_m, column) for column in path.places_m.T], axis=-1)
    lowest, highest = line.min(axis=0) - options.near_m, line.max(axis=0) + options.near_m
    cells = np.concatenate(obstacles_m)
    when = np.repeat(np.arange(len(obstacles_m)), [len(each) for each in obstacles_m])
    beside = ((cells >= lowest) & (cells <= highest)).all(axis=1)
    cells, when = cells[beside], when[beside]
    away, station = KDTree(line).query(cells, distance_upper_bound=options.near_m)
    at_m = station * _LOOK_M  # beyond the last one for cells that are far away
    near = np.isfinite(away) & (at_m >= first_m[when]) & (at_m <= last_m[when])
    parts = np.searchsorted(when[near], np.arange(1, len(obstacles_m)))
    return np.split(_cells(cells[near]), parts, axis=1)


def _clearance(
    drives: _Drives,
    obstacles: Sequence[_Cells],
    car: Footprint,
    longer_m: Float[np.ndarray, "k s"] | None = None,
) -> Float[np.ndarray, "k s"]:
    """Signed distance from the car's rectangle to the nearest cell, which counts as a disc; at most 10 m.

    ``longer_m`` is what the car has ahead of it at each time.
    """
    count = len(drives.places_m)
    found = np.full(drives.places_m.shape[:2], _FAR_M)
    lines, half_m = _rectangles(drives, car, np.zeros_like(found) if longer_m is None else longer_m)
    for step, cells in enumerate(obstacles):
        if not cells.shape[1]:
            continue
        # This is where all time goes: one product of matrices and few passes, in half the bytes.
        beyond = lines[step] @ cells
        np.subtract(np.abs(beyond, out=beyond), half_m[step], out=beyond)
        along, aside = beyond[:count], beyond[count:]
        inside = np.maximum(along, aside).min(axis=1)
        np.square(np.maximum(beyond, 0, out=beyond), out=beyond)
        outside = np.sqrt(np.add(along, aside, out=along).min(axis=1))
        found[:, step] = np.minimum(np.where(inside < 0, inside, outside) - CELL_M / 2, _FAR_M)
    return found


def _rectangles(
    drives: _Drives, car: Footprint, longer_m: Float[np.ndarray, "k s"]
) -> tuple[Float[np.ndarray, "s 2*k 3"], Float[np.ndarray, "s 2*k 1"]]:
    """Middle lines of cars, across and along, by coefficients of x, y and 1, and half the extent beside."""
    right = np.stack([drives.ahead[..., 1], -drives.ahead[..., 0]], axis=-1)
    axes = np.concatenate([drives.ahead, right])
    middle_m = (np.concatenate([drives.places_m, drives.places_m]) * axes).sum(-1)
    middle_m[: len(right)] += car.ahead_m + longer_m / 2
    half_m = np.concatenate([(car.length_m + longer_m) / 2, np.full_like(longer_m, car.width_m / 2)])
    lines = np.concatenate([axes, -middle_m[..., None]], axis=-1)
    return (
        np.ascontiguousarray(lines.swapaxes(0, 1), np.float32),
        np.ascontiguousarray(half_m.T[..., None], np.float32),
    )


def _cells(taken_m: Float[np.ndarray, "n 2"]) -> _Cells:
    return np.vstack([taken_m.T, np.ones(len(taken_m))]).astype(np.float32)
