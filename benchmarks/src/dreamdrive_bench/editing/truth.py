"""The same edits of the layout that a street is drawn from."""

from dataclasses import dataclass

import msgspec
import numpy as np
from jaxtyping import Float

from dreamdrive.scene.actor import Actor
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.layout import Box, Layout, TrackPoint, track_function
from dreamdrive.scene.street.truth import DriveTruth, WorldBox

WITHIN_M = 2.0
"""Mean distance of the places of an actor from those of its box."""


@dataclass(frozen=True)
class Pair:
    """An actor of a scene, the road user that it shows, and how far apart they are on the mean."""

    actor: Actor
    box: WorldBox
    apart_m: float


def pairs_of(scene: Scene, made: DriveTruth) -> list[Pair]:
    """Actors with their road users, those that fill most pixels first; each road user once."""
    movers = [box for box in made.boxes if box.moving]
    found: dict[int, Pair] = {}
    for actor in scene.actors:
        apart = [_apart_m(actor, box, made) for box in movers]
        if not apart or min(apart) > WITHIN_M:
            continue
        pair = Pair(actor, movers[int(np.argmin(apart))], min(apart))
        known = found.get(pair.box.instance)
        if known is None or known.actor.count < actor.count:
            found[pair.box.instance] = pair
    return sorted(found.values(), key=lambda pair: -int((made.instance == pair.box.instance).sum()))


def _apart_m(actor: Actor, box: WorldBox, made: DriveTruth) -> float:
    frames = np.searchsorted(made.times_s, actor.track.times_s - 1e-6).clip(max=len(made.times_s) - 1)
    pose = box.world_from_box[frames]
    bottom = pose[:, :3, 3] - pose[:, :3, 2] * box.size_m[2] / 2
    return float(np.linalg.norm(bottom - actor.track.positions_m, axis=1).mean())


def removed(layout: Layout, id: str) -> Layout:
    """Without a road user."""
    return msgspec.structs.replace(layout, boxes=[box for box in layout.boxes if box.id != id])


def moved(layout: Layout, id: str, at_s: float, ahead_m: float, left_m: float) -> Layout:
    """With a road user elsewhere, as it points at a time."""
    box = _box(layout, id)
    yaw = float(track_function(box.track)(np.array([at_s]))[0, 2])
    along = np.array([np.cos(yaw), np.sin(yaw)])
    by_m = ahead_m * along + left_m * np.array([-along[1], along[0]])
    track = [TrackPoint(p.t_s, p.x_m + float(by_m[0]), p.y_m + float(by_m[1]), p.yaw_rad) for p in box.track]
    return _with(layout, msgspec.structs.replace(box, track=track))


def turned(layout: Layout, id: str, degrees: float) -> Layout:
    """With a road user turned to the left."""
    box, by_rad = _box(layout, id), float(np.deg2rad(degrees))
    track = [TrackPoint(p.t_s, p.x_m, p.y_m, p.yaw_rad + by_rad) for p in box.track]
    return _with(layout, msgspec.structs.replace(box, track=track))


def delayed(layout: Layout, id: str, seconds: float) -> Layout:
    """With a road user that comes later."""
    box = _box(layout, id)
    track = [TrackPoint(p.t_s + seconds, p.x_m, p.y_m, p.yaw_rad) for p in box.track]
    return _with(layout, msgspec.structs.replace(box, track=track))


def inserted(
    layout: Layout, other: Layout, id: str, from_s: float, place_m: Float[np.ndarray, "2"]
) -> Layout:
    """With a road user of another layout, whose place at a time comes to one ahead and left of the car at 0.

    Its way relative to the first heading of its recording car becomes that relative to this one.
    """
    box = _box(other, id)
    here, there = (track_function(each.ego.track)(np.zeros(1))[0] for each in (layout, other))
    turn_rad = float(here[2] - there[2])
    start = track_function(box.track)(np.array([from_s]))[0, :2]
    place = here[:2] + _turn(float(here[2])) @ place_m
    track: list[TrackPoint] = []
    for point in box.track:
        x_m, y_m = place + _turn(turn_rad) @ (np.array([point.x_m, point.y_m]) - start)
        track.append(TrackPoint(point.t_s - from_s, float(x_m), float(y_m), point.yaw_rad + turn_rad))
    new = msgspec.structs.replace(box, id="inserted", track=track)
    return msgspec.structs.replace(layout, boxes=[*layout.boxes, new])


def room_m(layout: Layout, times_s: Float[np.ndarray, " f"]) -> float:
    """How near the last road user comes to another one or to the recording car, middle to middle."""
    *others, new = (track_function(box.track)(times_s)[:, :2] for box in layout.boxes)
    others.append(track_function(layout.ego.track)(times_s)[:, :2])
    return min(float(np.linalg.norm(each - new, axis=1).min()) for each in others)


def _turn(yaw_rad: float) -> Float[np.ndarray, "2 2"]:
    return np.array([[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]])


def _box(layout: Layout, id: str) -> Box:
    return next(box for box in layout.boxes if box.id == id)


def _with(layout: Layout, changed: Box) -> Layout:
    return msgspec.structs.replace(
        layout, boxes=[changed if box.id == changed.id else box for box in layout.boxes]
    )
