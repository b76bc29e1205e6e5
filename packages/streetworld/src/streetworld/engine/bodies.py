"""Bodies of road users: rigid parts, and how they turn as the whole moves on.

The frame of a body: x ahead, y to the left, z up, the origin on the ground under the middle.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from streetworld.engine.mesh import Mesh

Turn = Callable[[float], Float[np.ndarray, "4 4"]]
"""From the way travelled in metres to the pose of a part in its body."""

Size = tuple[float, float, float]


@dataclass(frozen=True)
class Part:
    """A rigid piece of a body; ``turn`` None never moves in it."""

    mesh: Mesh
    turn: Turn | None = None
