"""How a scenario goes: who of the drawn traffic may stay, what the true ego does, and whether all is well."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.scene.street.layout import Box, Layout, TrackPoint, is_moving
from dreamdrive_bench.planning.conflicts import Conflict, Stage
from dreamdrive_bench.planning.driver import STEP_S, Driver, covered
from dreamdrive_bench.planning.ego import EgoWay
from dreamdrive_bench.planning.footprints import (
    ego_rectangles,
    in_the_way,
    meetings,
    reference_poses,
    touching,
)
from dreamdrive_bench.planning.sight import pixels_seen
from dreamdrive_bench.planning.streets import Street
from streetworld import ego_poses, pinhole_of, to_track

_APART_M = 0.2
"""Between the road users of a conflict and parked ones, and around the ego."""
_FAR_M = 0.5
"""Between them and drawn traffic, which is taken away where it comes nearer."""
_NEAR_M = 0.4
"""So near the ego comes to a conflict at its present speed, at the least."""
_LEAST_MOVERS = 2
_MOST_BRAKING_M_S2, _MOST_ASIDE_M_S2 = 3.8, 2.8  # below 4 and 3: a track is kept to the millimetre
_SEEN_FRAMES, _SEEN_PX = 7, 80.0  # six with 60 are asked for: what is reckoned is rough


@dataclass(frozen=True)
class Played:
    """A street with a conflict and with what the true ego does; ``way`` is the line that it keeps to."""

    layout: Layout
    way: EgoWay
    actors: tuple[Box, ...]


def play(stage: Stage, conflict: Conflict) -> Played | None:
    """Bring a conflict into its street; None if anything is amiss."""
    street, actors = stage.street, conflict.boxes
    times = np.arange(round(stage.protocol.end_s / STEP_S) + 1) * STEP_S
    parked = [box for box in street.layout.boxes if not is_moving(box.track)]
    if actors:
        headed = _reached(stage, actors, times, _NEAR_M, straight=False).any()
        if not headed or not _possible(actors, parked, street, times):
            return None
    movers = _without_conflict(stage, actors, times)
    if not actors:
        reached = _reached(stage, parked, times, _APART_M, straight=True)
        if len(movers) < _LEAST_MOVERS or reached.any():
            return None
    way = replace(stage.ego, swerve=conflict.swerve)
    driven = _driven(way, movers, [*parked, *actors], times)
    if driven is None:
        return None
    layout = msgspec.structs.replace(
        street.layout,
        ego=msgspec.structs.replace(street.layout.ego, track=_track(way, driven.stations_m, times)),
        boxes=[*driven.movers, *parked, *actors],
    )
    if actors and not _in_view(stage, layout, actors[0]):
        return None
    return Played(layout, way, actors)


def _reached(
    stage: Stage, boxes: Sequence[Box], times_s: Float[np.ndarray, " t"], margin_m: float, *, straight: bool
) -> Bool[np.ndarray, " n"]:
    """Which boxes the ego reaches up to the horizon at its speed, in its lane or, if asked, straight on."""
    poses = stage.ego.poses(stage.ego.steady(times_s))
    ways = [poses]
    if straight:
        now = round(stage.protocol.instant_s / STEP_S)
        after = np.clip(times_s - stage.protocol.instant_s, 0, None)[:, None]
        gone = np.where(after > 0, poses[now], poses)
        gone[:, :2] += after * (poses[now] - poses[now - 1])[:2] / STEP_S
        ways.append(gone)
    known = times_s <= stage.protocol.instant_s + stage.protocol.horizon_s + 1e-9
    found = np.zeros(len(boxes), bool)
    for way in ways:
        found |= meetings(ego_rectangles(reference_poses(way), margin_m), boxes, times_s)[known].any(axis=0)
    return found


def _possible(
    actors: Sequence[Box], parked: Sequence[Box], street: Street, times_s: Float[np.ndarray, " t"]
) -> bool:
    """Whether the actors are clear of each other, of parked vehicles, houses, trees and posts."""
    among = touching(actors, actors, times_s, 0.0) & ~np.eye(len(actors), dtype=bool)
    beside = touching(actors, parked, times_s, _APART_M)
    return not (among.any() or beside.any() or in_the_way(actors, street.solid, times_s).any())


def _without_conflict(stage: Stage, actors: Sequence[Box], times_s: Float[np.ndarray, " t"]) -> list[Box]:
    """The drawn traffic that has nothing to do with the ego nor with the road users of the conflict."""
    movers = [box for box in stage.street.layout.boxes if is_moving(box.track)]
    leaves = _reached(stage, movers, times_s, _APART_M, straight=True)
    leaves |= touching(movers, actors, times_s, _FAR_M).any(axis=1)
    return [box for box, gone in zip(movers, leaves, strict=True) if not gone]


@dataclass(frozen=True)
class _Driven:
    """Stations of the true ego (T,), and the drawn traffic that it never meets."""

    stations_m: Float[np.ndarray, " t"]
    movers: list[Box]


def _driven(
    way: EgoWay, movers: list[Box], others: Sequence[Box], times_s: Float[np.ndarray, " t"]
) -> _Driven | None:
    """What the true ego does; None if it meets one of the others, or has to drive roughly."""
    now = int(np.searchsorted(times_s, way.instant_s - 1e-6))
    while True:
        after = Driver().drive(way, covered(way, [*movers, *others], times_s[now:]))
        stations = np.concatenate([way.before(times_s[:now]), after])
        poses = reference_poses(way.poses(stations))
        if not _comfortable(poses[now - 2 :]):
            return None
        ego = ego_rectangles(poses, _APART_M)
        if meetings(ego, others, times_s).any():
            return None
        met = np.any(meetings(ego, movers, times_s), axis=0)
        if not met.any():
            return _Driven(stations, movers)
        movers = [box for box, gone in zip(movers, met, strict=True) if not gone]


def _comfortable(poses: Float[np.ndarray, "t 3"]) -> bool:
    """Whether a car may drive so, with people in it."""
    change = np.diff(poses[:, :2], n=2, axis=0) / STEP_S**2
    cos, sin = np.cos(poses[1:-1, 2]), np.sin(poses[1:-1, 2])
    ahead, aside = cos * change[:, 0] + sin * change[:, 1], cos * change[:, 1] - sin * change[:, 0]
    return bool((ahead >= -_MOST_BRAKING_M_S2).all() and (np.abs(aside) <= _MOST_ASIDE_M_S2).all())


def _track(
    way: EgoWay, stations: Float[np.ndarray, " t"], times_s: Float[np.ndarray, " t"]
) -> list[TrackPoint]:
    """Of the front camera, one step longer than the times."""
    longer = np.append(stations, 2 * stations[-1] - stations[-2])
    return to_track(np.append(times_s, times_s[-1] + STEP_S), way.poses(longer))


def _in_view(stage: Stage, layout: Layout, actor: Box) -> bool:
    """Whether the front camera sees enough of a road user, also at the instant."""
    times = stage.protocol.frame_times_s
    lens = pinhole_of(layout, stage.protocol.size_px)
    cameras = [lens.at(pose) for pose in ego_poses(layout, times)]
    others = [box for box in layout.boxes if box.id != actor.id]
    seen = pixels_seen(actor, stage.street.houses, others, cameras, times) >= _SEEN_PX
    return bool(seen.sum() >= _SEEN_FRAMES and seen[-1])
