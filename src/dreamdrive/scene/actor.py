"""Actors: things that move."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

_LEAST_WAY_M = 1.0  # that tells where a thing points
_RATE_S = 0.5  # over which the rate at the ends of a track is taken


@dataclass(frozen=True)
class Track:
    """Where a thing is over time: places of the middle of its bottom in the world, and its yaw.

    Times increase strictly. The yaw is about the up axis of the scene, right-handed, against the attitude of
    the thing in its canonical place.
    """

    times_s: Float[np.ndarray, " t"]
    positions_m: Float[np.ndarray, "t 3"]
    yaw_rad: Float[np.ndarray, " t"]

    def __post_init__(self) -> None:
        counts = len(self.times_s), len(self.positions_m), len(self.yaw_rad)
        if len(set(counts)) > 1:
            raise ValueError(f"track: numbers of times, places and yaws differ: {counts}")
        if not counts[0] or (np.diff(self.times_s) <= 0).any():
            raise ValueError("track: expected at least one point and strictly increasing times")

    @property
    def length_m(self) -> float:
        """Length of the path."""
        return float(np.linalg.norm(np.diff(self.positions_m, axis=0), axis=1).sum())

    @property
    def speed_m_s(self) -> Float[np.ndarray, " t"]:
        """Speed at each point, by its neighbours; 0 where there is one point alone."""
        if len(self.times_s) < 2:
            return np.zeros(1)
        return np.linalg.norm(np.gradient(self.positions_m, self.times_s, axis=0), axis=1)

    def at(self, times_s: Float[np.ndarray, " k"]) -> "Track":
        """The track at other times: linear between those known, at a constant rate beyond them."""
        known = np.column_stack([self.positions_m, np.unwrap(self.yaw_rad)])
        found = np.stack([np.interp(times_s, self.times_s, column) for column in known.T], axis=1)
        for beyond, end in ((times_s < self.first_s, 0), (times_s > self.last_s, -1)):
            if len(self.times_s) > 1 and beyond.any():
                away_s = (times_s[beyond] - self.times_s[end])[:, None]
                found[beyond] = known[end] + away_s * self._rate_at(known, end)
        return Track(times_s, found[:, :3], found[:, 3])

    def _rate_at(self, known: Float[np.ndarray, "k 4"], end: int) -> Float[np.ndarray, "4"]:
        """Mean rate at one end, over ``_RATE_S``: two places alone would tell the noise of theirs."""
        since_s = np.abs(self.times_s - self.times_s[end])
        near = since_s <= max(_RATE_S, np.partition(since_s, 1)[1]) + 1e-9
        centred_s = self.times_s[near] - self.times_s[near].mean()
        return centred_s @ known[near] / (centred_s @ centred_s)

    @property
    def first_s(self) -> float:
        """Its first time."""
        return float(self.times_s[0])

    @property
    def last_s(self) -> float:
        """Its last time."""
        return float(self.times_s[-1])


UNKNOWN = "unknown"
"""Kind of an actor of which nobody said what it is."""


@dataclass(frozen=True)
class ActorBox:
    """How large an actor is, length, width and height, and where it points at yaw 0, in the world."""

    size_m: Float[np.ndarray, "3"]
    ahead: Float[np.ndarray, "3"]

    def __post_init__(self) -> None:
        if not (self.size_m > 0).all():
            raise ValueError(f"box: size {self.size_m}, expected lengths above 0")
        if abs(np.linalg.norm(self.ahead) - 1) > 1e-3:
            raise ValueError(f"box: direction {self.ahead}, expected one of length 1")

    def pointing(self, yaw_rad: float, up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """Where it points at a yaw about the up axis, in the world."""
        left = np.cross(up, self.ahead)
        return np.cos(yaw_rad) * self.ahead + np.sin(yaw_rad) * left


@dataclass(frozen=True)
class Actor:
    """A group of dynamic Gaussians that move as one: those whose ``Gaussians.actor`` is ``id``.

    Attributes:
        id: See above.
        name: Unique, for people, such as ``"actor 3"``.
        kind: ``"vehicle"``, ``"two-wheeler"``, ``"person"`` or ``"unknown"``.
        count: Number of its Gaussians.
        track: Where the middle of its bottom is at the frames that saw it.
        box: Its size and where it points, as far as frames and what is usual tell; None where nothing does.
        spread_m: Standard deviation of its place at these (T,) along the axis in which it is known least, as
            the estimate of its track believes; None where nothing tells.
        completed: Whether a side that no frame saw was mirrored from one that some did.
    """

    id: int
    name: str
    kind: str
    count: int
    track: Track
    box: ActorBox | None = None
    spread_m: Float[np.ndarray, " t"] | None = None
    completed: bool = False

    def ahead(self, up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"] | None:
        """Where it points in the middle of its track, of length 1: its box tells, else the way it goes.

        None where neither does.
        """
        if self.box is not None:
            return self.box.pointing(float(self.track.yaw_rad[len(self.track.yaw_rad) // 2]), up)
        way = self.track.positions_m[-1] - self.track.positions_m[0]
        level = way - (way @ up) * up
        length_m = float(np.linalg.norm(level))
        return level / length_m if length_m > _LEAST_WAY_M else None

    def __post_init__(self) -> None:
        if self.spread_m is not None and len(self.spread_m) != len(self.track.times_s):
            raise ValueError(
                f"{self.name}: {len(self.spread_m)} spreads for {len(self.track.times_s)} points"
            )
