"""Observations of a rigid thing that moves, and the placement that is made of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.scene.camera import Camera

STATE = 5
"""Unknowns of a frame: place along three axes, yaw, logarithm of the factor of depth."""


@dataclass(frozen=True)
class PlacingOptions:
    """How much each measurement is trusted: standard deviations. Their worth: docs/results/ablation.md.

    Attributes:
        flow_px: Of a point carried by optical flow.
        lost_px: At which flow counts as lost at first; in the end it is three times ``flow_px``.
        depth: Of the logarithm of the depth at which two frames see one point.
        factor: Of the logarithm of the factor of a frame's depth.
        shape: Of the logarithm of a point's depth beside that: frames see shapes a little wrong.
        place: Of the middle of a frame's points, a share of their distance: each frame sees another part.
        cut_m: Added where the border of the picture cuts the thing off: one end is all that it shows.
        acceleration_m_s2: Of what moves along the road.
        climb_m_s2: Of what moves across it.
        yaw_rate_deg_s: Of the yaw.
        yaw_acceleration_deg_s2: Of the change of the yaw's rate.
        slip_m_s: Of the speed across the direction in which a thing points: vehicles go where they point.
        most_m_s: Median speed from which on there is no track: stray points at rims of other things leap.
        most_spread_m: Median deviation of the place from which on there is no track.
        samples: Most points that are carried from one frame to another.
        independent: So many of them count, as neighbours err alike.
    """

    flow_px: float = 0.7
    lost_px: float = 12.0
    depth: float = 0.1
    factor: float = 0.08
    shape: float = 0.06
    place: float = 0.06
    cut_m: float = 3.0
    acceleration_m_s2: float = 1.5
    climb_m_s2: float = 0.3
    yaw_rate_deg_s: float = 8.0
    yaw_acceleration_deg_s2: float = 16.0
    slip_m_s: float = 0.3
    most_m_s: float = 60.0
    most_spread_m: float = 3.0
    samples: int = 300
    independent: float = 6.0


@dataclass(frozen=True)
class Observations:
    """The K frames that saw a thing, in order.

    Attributes:
        cameras: Their cameras.
        times_s: Their times.
        middles_m: The middles of what they saw, in the world.
        whole: Which of them saw all of it: the border of the picture cuts it off in the others.
    """

    cameras: Sequence[Camera]
    times_s: Float[np.ndarray, " k"]
    middles_m: Float[np.ndarray, "k 3"]
    whole: Bool[np.ndarray, " k"]


@dataclass(frozen=True)
class Carried:
    """Points that flow carries from one frame of a thing to another.

    Frames are told by their index among those that saw the thing. Each of the N points has its number among
    those of the first frame, its place and its depth in the first picture and in the second.
    """

    first: int
    second: int
    point: Int[np.ndarray, " n"]
    first_px: Float[np.ndarray, "n 2"]
    first_m: Float[np.ndarray, " n"]
    second_px: Float[np.ndarray, "n 2"]
    second_m: Float[np.ndarray, " n"]


@dataclass(frozen=True)
class PointDepth:
    """The N points of one frame that were carried: their numbers, and the factor of the depth of each."""

    point: Int[np.ndarray, " n"]
    factor: Float[np.ndarray, " n"]


@dataclass(frozen=True)
class Placement:
    """A rigid thing in each of K frames.

    Attributes:
        place_m: Of one point of it, in the world.
        yaw_rad: Turn about the up axis, right-handed, against a frame about the middle.
        factor: Of the depth that each frame saw.
        ahead: Where the thing points in the middle one of the frames: a unit vector in the world.
        spread_m: Standard deviation of the place along the axis in which it is known least.
        points: What is known of the depth of single points of each frame; ``factor`` is for the rest.
    """

    place_m: Float[np.ndarray, "k 3"]
    yaw_rad: Float[np.ndarray, " k"]
    factor: Float[np.ndarray, " k"]
    spread_m: Float[np.ndarray, " k"]
    ahead: Float[np.ndarray, "3"]
    points: tuple[PointDepth, ...] = ()


def is_whole(places: Float[np.ndarray, "n 3"], width_px: int, reach_px: float) -> bool:
    """Whether places (column, row, depth) keep away from the sides of a picture of this width."""
    return bool(places[:, 0].min() > reach_px and places[:, 0].max() < width_px - reach_px)
