"""Place, yaw and depth of a rigid thing in each frame that saw it, solved over all frames at once.

A frame's depth tells how far its points are from each other better than how far they are away. What is
estimated is therefore, for each frame, the place and the yaw of the thing and one factor of the depth that
the frame saw, and a little of each point's own, so that points which optical flow carries from one frame to
another meet there: in the image as well as in depth. Motion is smooth, and a thing goes where it points.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from dreamdrive.decompose.actors.observations import STATE, Carried, Observations, Placement, PlacingOptions
from dreamdrive.decompose.actors.points import MOST_FACTOR, CarriedPoints
from dreamdrive.decompose.actors.smooth_motion import SmoothMotion

_STEPS = 24
_STILL_M = 1e-3  # by which the last step may still move a place


def placed(
    seen: Observations, carried: Sequence[Carried], up: Float[np.ndarray, "3"], options: PlacingOptions
) -> Placement:
    """The motion that explains most; ``up`` is the axis of yaw."""
    count = len(seen.cameras)
    points = CarriedPoints(seen.cameras, carried, up, options) if carried else None
    motion = SmoothMotion(seen, up, options)
    state, course_rad = np.zeros((count, STATE)), 0.0
    state[:, :3] = seen.middles_m
    normal = np.eye(state.size + 1)
    for step in range(_STEPS):
        normal, gradient = motion.terms(state, course_rad)
        # The first step has no points: from far away the wrong ones would pass for lost.
        meet = points if step else None
        if meet is not None:
            narrowed = max(0.0, 1 - step / (0.6 * _STEPS))
            more, pull = meet.terms(state, 3 * options.flow_px + narrowed * options.lost_px)
            normal[:-1, :-1] += more
            gradient[:-1] += pull
        *change, turn_rad = np.linalg.solve(normal, -gradient)
        change = np.reshape(change, state.shape)
        state, course_rad = state + change, course_rad + float(turn_rad)
        state[:, 4] = state[:, 4].clip(-MOST_FACTOR, MOST_FACTOR)
        if meet is not None:
            meet.follow(change)
        if step > 0.7 * _STEPS and np.abs(change[:, :3]).max() < _STILL_M:
            break
    factor, spread_m = np.exp(state[:, 4]), _spread_m(np.linalg.inv(normal)[:-1, :-1], count)
    yaw_rad = state[:, 3] - state[count // 2, 3]
    ahead = motion.ahead(course_rad + state[count // 2, 3])
    # Slip does not tell forwards from backwards; hardly anything drives backwards.
    ahead = -ahead if ahead @ (state[-1, :3] - state[0, :3]) < 0 else ahead
    return Placement(state[:, :3], yaw_rad, factor, spread_m, ahead, points.depths(factor) if points else ())


def _spread_m(covariance: Float[np.ndarray, "m m"], count: int) -> Float[np.ndarray, " k"]:
    """Of each place, the deviation along the axis in which it is known least."""
    blocks = covariance.reshape(count, STATE, count, STATE)[np.arange(count), :3, np.arange(count), :3]
    return np.sqrt(np.linalg.eigvalsh(blocks)[:, -1].clip(0))
