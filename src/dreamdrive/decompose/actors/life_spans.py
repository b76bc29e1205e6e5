"""Life spans of the copies of an actor's surface.

Every training frame leaves a copy of what it sees of an actor. Where another frame has its own, nearer in
time, an older copy only blurs it. But what no other frame sees is there all the same: the rear of a car that
still has to overtake shows in a view from the side. A copy therefore lives on until a frame sees its surface
again.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from dreamdrive.scene.camera import Camera

_LIKE_DEPTH = 0.12  # in the logarithm
_LEAST_THROUGH = 2  # frames that see through what is misplaced, and ...
_MOST_THROUGH = 0.5  # ... their share of those that should see it
_WIDTH = (
    0.6  # standard deviation over half the length of a long life: at its ends a copy keeps half its opacity
)


@dataclass(frozen=True)
class ActorView:
    """What one training frame saw of an actor; ``world_from_canonical`` tells where it was.

    It left copies (column, row, depth along z); ``depth_m`` is of all that it saw, 0 where that is unknown.
    """

    time_s: float
    camera: Camera
    world_from_canonical: Float[np.ndarray, "4 4"]
    copies: Float[np.ndarray, "m 3"]
    depth_m: Float[np.ndarray, "h w"]


def life_spans(
    places: Float[np.ndarray, "n 3"],
    source: Int[np.ndarray, " n"],
    views: Sequence[ActorView],
    span_s: tuple[float, float],
    deviation_s: float,
    reach_px: float,
) -> Float[np.ndarray, "n 2"]:
    """Centre and standard deviation of each copy's life in seconds, by its canonical place in the world.

    ``source`` tells which of the views, in the order of time, each copy is from; ``span_s`` is the clip's;
    ``deviation_s`` that of a copy that its neighbours in time replace. Neighbours in an image are at most
    ``reach_px`` apart.
    """
    unseen = np.stack([unseen_by(view, places, reach_px) for view in views])
    times = np.array([view.time_s for view in views])
    begin = _until(unseen, source, times, -1, span_s[0])
    end = _until(unseen, source, times, 1, span_s[1])
    return np.stack([(begin + end) / 2, deviation_s + _WIDTH * (end - begin) / 2], axis=1)


def _until(
    unseen: Bool[np.ndarray, "k n"],
    source: Int[np.ndarray, " n"],
    times: np.ndarray,
    way: int,
    limit_s: float,
) -> Float[np.ndarray, " n"]:
    """Time of the last frame on one side up to which none sees the surface; the limit if none ever does."""
    until, living, at = times[source], np.ones(len(source), bool), source.copy()
    for _ in times:
        at = at + way
        beyond = (at < 0) | (at >= len(times))
        until[living & beyond & (at - way != source)] = limit_s
        living &= ~beyond
        rows = np.flatnonzero(living)
        living[rows] = unseen[at[rows], rows]
        rows = np.flatnonzero(living)
        until[rows] = times[at[rows]]
    return until


def unseen_by(view: ActorView, places: Float[np.ndarray, "n 3"], reach_px: float) -> Bool[np.ndarray, " n"]:
    """Which surfaces a frame cannot see: out of view, or behind the actor itself or something else.

    One that would stand in front of what the frame saw, or beside the actor, is misplaced: it counts as seen.
    """
    return _looked_for(view, places, reach_px)[0]


def misplaced(
    places: Float[np.ndarray, "n 3"], views: Sequence[ActorView], reach_px: float
) -> Bool[np.ndarray, " n"]:
    """Which surfaces most of the frames that should see them show beside the actor, where they see through.

    Depth is least sure at outlines. What one frame puts at the wrong distance there, others see past.
    """
    looked = [_looked_for(view, places, reach_px) for view in views]
    unseen, beside = (np.stack(each) for each in zip(*looked, strict=True))
    through = beside.sum(axis=0)
    return (through >= _LEAST_THROUGH) & (through > _MOST_THROUGH * (~unseen).sum(axis=0))


def _looked_for(
    view: ActorView, places: Float[np.ndarray, "n 3"], reach_px: float
) -> tuple[Bool[np.ndarray, " n"], Bool[np.ndarray, " n"]]:
    """Which surfaces a frame cannot see, and which of the others it does not show as the actor's."""
    moved = view.world_from_canonical
    projected = view.camera.project(places @ moved[:3, :3].T + moved[:3, 3])
    in_view = view.camera.shows(projected)
    unseen, where = ~in_view, projected[in_view, :2]
    shown_m = view.depth_m[where[:, 1].astype(int), where[:, 0].astype(int)].astype(np.float64)
    own = np.zeros(len(where), bool)
    if len(view.copies) and len(where):
        distance, nearest = KDTree(view.copies[:, :2]).query(where, distance_upper_bound=reach_px)
        own = np.isfinite(distance)
        shown_m[own] = view.copies[np.asarray(nearest)[own], 2]
    unseen[in_view] = (shown_m > 0) & (projected[in_view, 2] > np.exp(_LIKE_DEPTH) * shown_m)
    beside = np.zeros(len(places), bool)
    beside[in_view] = ~own
    return unseen, beside & ~unseen
