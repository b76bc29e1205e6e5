"""What a network that sees many frames at once takes and gives, whoever made it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from torch import Tensor

from dreamdrive.scene.camera import Camera

METRE_SPREAD = 0.15
"""How far the metre of a network that claims it may be off. Assumed: the authors give errors on data sets of
their own, none for drives; it is as much as an assumed height of the camera."""


@dataclass(frozen=True)
class Views:
    """What a network is shown.

    Attributes:
        pictures: RGB (N, 3, H, W) in [0, 1], both sides multiples of 14.
        camera: Pinhole of the pictures where it is calibrated.
        world_from_camera: Poses (N, 4, 4) where they are known.
        metric: Whether these poses are in metres.
    """

    pictures: Float[Tensor, "n 3 h w"]
    camera: Camera | None = None
    world_from_camera: Float[np.ndarray, "n 4 4"] | None = None
    metric: bool = True


@dataclass(frozen=True)
class Seen:
    """What it sees in them, in a world and a unit of its own.

    Attributes:
        world_from_camera: Rigid poses (N, 4, 4); x right, y down, z forward.
        intrinsics: Pinholes (N, 3, 3) in pixels of the pictures; the centre of the top-left one is at
            (0.5, 0.5).
        depth: Depth along z (N, H, W) in the unit of the poses; 0 where there is none.
        confidence: Grows with trust (N, H, W), on any scale that all calls of the network share.
    """

    world_from_camera: Float[np.ndarray, "n 4 4"]
    intrinsics: Float[np.ndarray, "n 3 3"]
    depth: Float[np.ndarray, "n h w"]
    confidence: Float[np.ndarray, "n h w"]


@dataclass(frozen=True)
class Network:
    """A network with its weights.

    Attributes:
        look: From views to what is seen in them.
        unit: What says that its unit is the metre, in words; None where it has none.
        unit_spread: How far that metre may be off, as a fraction.
    """

    look: Callable[[Views], Seen]
    unit: str | None = None
    unit_spread: float = 0.0
