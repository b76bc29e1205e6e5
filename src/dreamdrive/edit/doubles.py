"""Second actors of one thing: where a track broke, some frames of it are an actor of their own."""

from collections.abc import Sequence

import numpy as np

from dreamdrive.scene.actor import Actor
from dreamdrive.scene.scene import Scene

_INSIDE = 0.8
"""Share of the frames of a smaller actor that are inside the box of a larger one: two things never are."""


def without_doubles(before: Scene, after: Scene, leave: Sequence[Actor]) -> Scene:
    """``after`` less the actors that are inside one of those who leave, unless they are edited themselves."""
    gone = {actor.id for actor in leave}
    kept = {actor.id for actor in after.actors} - gone
    for actor in leave:
        for other in before.actors:
            if other.id in kept and _is_inside(other, actor, before):
                after = after.without(other.id)
                kept.remove(other.id)
    return after


def _is_inside(part: Actor, whole: Actor, scene: Scene) -> bool:
    """Whether an actor is a smaller one at the place of another."""
    if whole.box is None or part.count >= whole.count:
        return False
    at, up = whole.track.at(part.track.times_s), scene.up
    ahead = np.stack([whole.box.pointing(float(yaw), up) for yaw in at.yaw_rad])
    away_m = part.track.positions_m - at.positions_m
    axes = np.stack([ahead, np.cross(up, ahead), np.broadcast_to(up, ahead.shape)], axis=1)
    along = np.einsum("tij,tj->ti", axes, away_m)
    length_m, width_m, height_m = whole.box.size_m
    within = np.abs(along) < (length_m / 2, width_m / 2, height_m)
    return bool(within.all(axis=1).mean() >= _INSIDE)
