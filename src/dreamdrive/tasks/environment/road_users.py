"""The actors of a scene as road users: boxes on the ground that are somewhere at any time."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.scene.scene import Scene
from dreamdrive.tasks.plan import overlapping

_AT_END_S = 0.3
"""An actor that was seen within so much of the end of the recording goes on after it."""
_EDGE_S = 1e-6


@dataclass(frozen=True)
class RoadUserStates:
    """N road users, each at a time of its own.

    Attributes:
        boxes: Middle x and y, length, width and heading in the level frame (N, 5).
        speeds_m_s: (N,).
        ways_m: How far each came since the recording began (N,).
        there: Which of them are anywhere (N,).
    """

    boxes: Float[np.ndarray, "n 5"]
    speeds_m_s: Float[np.ndarray, " n"]
    ways_m: Float[np.ndarray, " n"]
    there: Bool[np.ndarray, " n"]


@dataclass(frozen=True)
class RoadUsers:
    """N actors with boxes, at T times and beyond.

    Attributes:
        ids: Of the actors, in the order of the scene.
        kinds: What they are.
        sizes_m: Length and width (N, 2).
        times_s: Of the recording (T,).
        table: x, y and heading in the level frame, way and speed (T, N, 5).
        rates: Of these in a second after the last time (N, 5).
        seen_s: From when to when each is there (N, 2); to infinity what is there at the end.
        solid: Which of them can be hit (N,).
        ego: Rectangles of the recorded car (T, 5).
    """

    ids: tuple[int, ...]
    kinds: tuple[str, ...]
    sizes_m: Float[np.ndarray, "n 2"]
    times_s: Float[np.ndarray, " t"]
    table: Float[np.ndarray, "t n 5"]
    rates: Float[np.ndarray, "n 5"]
    seen_s: Float[np.ndarray, "n 2"]
    solid: Bool[np.ndarray, " n"]
    ego: Float[np.ndarray, "t 5"]

    def __len__(self) -> int:
        return len(self.ids)

    def states(self, clocks_s: Float[np.ndarray, " n"]) -> RoadUserStates:
        """All of them, each at its own time."""
        at = self._looked_up(clocks_s, np.arange(len(self)))
        boxes = np.concatenate([at[:, :2], self.sizes_m, at[:, 2:3]], axis=1)
        there = (clocks_s >= self.seen_s[:, 0] - _EDGE_S) & (clocks_s <= self.seen_s[:, 1] + _EDGE_S)
        return RoadUserStates(boxes, at[:, 4], at[:, 3], there)

    def ego_at(self, time_s: float) -> Float[np.ndarray, "5"]:
        """The rectangle of the recorded car at a time; the ends held."""
        return np.array([np.interp(time_s, self.times_s, column) for column in self.ego.T])

    def swept(self, user: int, ways_m: Float[np.ndarray, " k"]) -> Float[np.ndarray, "k 5"]:
        """The boxes of one where it comes as far as these ways, which increase; fewer where it never does."""
        known_m, rows = np.unique(self.table[:, user, 3], return_index=True)
        clocks_s = np.interp(ways_m, known_m, self.times_s[rows])
        beyond_m, rate = ways_m - known_m[-1], float(self.rates[user, 3])
        if rate > 0:
            clocks_s = np.where(beyond_m > 0, self.times_s[-1] + beyond_m / max(rate, _EDGE_S), clocks_s)
        else:
            clocks_s = clocks_s[beyond_m <= 0]
        at = self._looked_up(clocks_s, np.full(len(clocks_s), user))
        size_m = np.broadcast_to(self.sizes_m[user], (len(at), 2))
        return np.concatenate([at[:, :2], size_m, at[:, 2:3]], axis=1)

    def _looked_up(
        self, clocks_s: Float[np.ndarray, " k"], road_users: np.ndarray
    ) -> Float[np.ndarray, "k 5"]:
        times_s = self.times_s
        after = np.clip(np.searchsorted(times_s, clocks_s, side="right"), 1, max(len(times_s) - 1, 1))
        before, after = after - 1, np.minimum(after, len(times_s) - 1)
        inside_s = np.clip(clocks_s, times_s[0], times_s[-1])
        share = (inside_s - times_s[before]) / np.maximum(times_s[after] - times_s[before], _EDGE_S)
        start = self.table[before, road_users]
        at = start + share[:, None] * (self.table[after, road_users] - start)
        beyond_s = clocks_s - inside_s
        return at + np.maximum(beyond_s, 0.0)[:, None] * self.rates[road_users]


def road_users_of(
    scene: Scene, level_from_world: Float[np.ndarray, "4 4"], ego: Float[np.ndarray, "t 5"]
) -> RoadUsers:
    """The actors of a scene that have a box.

    Nothing is known of an actor before it was first seen, and after it was last seen, unless that is the end
    of the recording. A box that the recorded car drove through is wrong: it cannot be hit.

    Args:
        scene: What holds them.
        level_from_world: Of the scene.
        ego: The rectangles of the recorded car at the times of the scene's trajectory.
    """
    times_s = scene.trajectory.times_s
    actors = [actor for actor in scene.actors if actor.box is not None]
    table, rates = np.zeros((len(times_s), len(actors), 5)), np.zeros((len(actors), 5))
    seen_s, sizes_m = np.zeros((len(actors), 2)), np.ones((len(actors), 2))
    rotation, end_s = level_from_world[:3, :3], float(times_s[-1])
    for row, actor in enumerate(actors):
        assert actor.box is not None
        ahead = rotation @ actor.box.ahead
        track = actor.track.at(np.append(times_s, end_s + 1.0))
        level_m = track.positions_m @ rotation.T + level_from_world[:3, 3]
        placed = np.column_stack([level_m[:, :2], np.arctan2(ahead[1], ahead[0]) + track.yaw_rad])
        table[:, row, :3], rates[row, :3] = placed[:-1], placed[-1] - placed[-2]
        sizes_m[row] = actor.box.size_m[:2]
        last_s = actor.track.last_s
        seen_s[row] = actor.track.first_s, np.inf if last_s > end_s - _AT_END_S else last_s
    way_m = np.linalg.norm(np.diff(table[..., :2], axis=0), axis=-1).cumsum(axis=0)
    table[1:, :, 3] = way_m
    rates[:, 3] = np.hypot(rates[:, 0], rates[:, 1])
    if len(times_s) > 1:
        table[..., 4] = np.gradient(table[..., 3], times_s, axis=0)
    ids, kinds = tuple(actor.id for actor in actors), tuple(actor.kind for actor in actors)
    solid = np.ones(len(actors), dtype=bool)
    road_users = RoadUsers(ids, kinds, sizes_m, times_s, table, rates, seen_s, solid, ego)
    return replace(road_users, solid=~_driven_through(road_users))


def _driven_through(road_users: RoadUsers) -> Bool[np.ndarray, " n"]:
    """Which boxes the recorded car touched while they were there."""
    touched = np.zeros(len(road_users), dtype=bool)
    for time_s, rectangle in zip(road_users.times_s, road_users.ego, strict=True):
        states = road_users.states(np.full(len(road_users), time_s))
        touched |= states.there & overlapping(rectangle[None], states.boxes)
    return touched
