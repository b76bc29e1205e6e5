"""What frames tell of a rigid thing that moves, and what is made of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.scene.camera import Camera

STATE = 5
"""Unknowns of a frame: place along three axes, yaw, logarithm of the factor of depth."""


@dataclass(frozen=True)
class PlacingOptions:
    """How much each measurement is trusted: standard deviations.

    Attributes:
        flow_px: Of a point carried by optical flow.
        lost_px: At which flow counts as lost when the estimate begins; in the end it is three times
            ``flow_px``.
        depth: Of the logarithm of the depth at which two frames see one point.
        factor: Of the logarithm of the factor of a frame's depth.
        shape: Of the logarithm of a point's depth beside that. Without it (1e-4) what moves on drawn streets
            0, 3, 4 and 6 keeps the shape that its frames saw, off by 1.5-3.7 % in place of 1-2.2 %.
        place: Of the middle of the points of a frame, in shares of their distance: each frame sees another
            part of the thing.
        cut_m: Added to that where the border of the picture cuts the thing off: one end is all that it shows.
            With 0.3, as where it is whole, a van that overtakes on drawn street 3 is 0.24 m off in place of
            0.14, and the view 2 m aside loses 1.7 dB.
        acceleration_m_s2: Of what moves along the road.
        climb_m_s2: Across it.
        yaw_rate_deg_s: Of its yaw. With 20, a change of 40 and an acceleration of 2.5 the boxes of drawn
            streets 0-7 are off by 0.19 m in place of 0.15.
        yaw_acceleration_deg_s2: Of the change of that.
        slip_m_s: Of the speed across the direction in which the thing points, which is one more unknown:
            vehicles go where they point. Without it a van on drawn street 3 turns by 4 degrees where the
            border cuts it off.
        most_m_s: Median speed ...
        most_spread_m: ... and median deviation of the place from which on there is no track: stray points at
            the rims of other things leap at 80-560 m/s. Without these limits standing things of drawn street
            15 seem to move 293 mm in place of 15.
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
class Glances:
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
