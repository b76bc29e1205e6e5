"""An instant of planning, as plain values."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.street.layout import Layout
from dreamdrive_bench.planning.protocol import Kind


@dataclass(frozen=True)
class Scenario:
    """An instant of planning.

    The reference point of the ego is the point of the road 0.76 m behind its front camera.

    Attributes:
        name: The kind and the seed.
        kind: What happens ahead.
        seed: That of the scenario.
        layout: The street and all road users from time 0, the first frame, to some time after the horizon.
        instant_s: When the planner plans: the time of the last frame that is seen.
        lane_m: Middle of the ego's lane in the map frame (N, 2), every metre from 10 m behind the ego on.
        times_s: Every tenth of a second from the instant to the end of the layout (T,).
        true_poses: x, y, yaw of the ego's reference point in the map frame at these times (T, 3).
        actors: Names of the boxes that the conflict is with, the foremost first; none if there is none.
    """

    name: str
    kind: Kind
    seed: int
    layout: Layout
    instant_s: float
    lane_m: Float[np.ndarray, "n 2"]
    times_s: Float[np.ndarray, " t"]
    true_poses: Float[np.ndarray, "t 3"]
    actors: tuple[str, ...]
