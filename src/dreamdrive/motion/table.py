"""All representations of motion by name: what fits, scenes on disk and the command line choose from."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

import torch
from torch import Tensor

from dreamdrive.motion.baselines.hexplane import HexPlaneField
from dreamdrive.motion.baselines.vibration import Vibration
from dreamdrive.motion.deformation import DeformationField
from dreamdrive.motion.protocol import Motion, MotionConfig, Start
from dreamdrive.names import RepresentationName
from dreamdrive.scene.gaussians import Gaussians

MOTIONS: Mapping[str, type[Motion]] = MappingProxyType(
    {motion.kind: motion for motion in (DeformationField, HexPlaneField, Vibration)}
)
"""Every motion by its name on disk."""


@dataclass(frozen=True)
class Representation:
    """A way of telling a street over time.

    Attributes:
        moves: Which Gaussians go through the motion: none, all, or those that score as moving.
        motion: What moves them; None where nothing moves.
        step: Time of a step of the joint fit for one of hybrid, on 12 frames of 320x180.
    """

    moves: Literal["none", "all", "scored"]
    motion: type[Motion] | None
    step: float


REPRESENTATIONS: Mapping[RepresentationName, Representation] = MappingProxyType(
    {
        "hybrid": Representation("scored", DeformationField, 1.0),
        "static": Representation("none", None, 0.9),
        "deformable": Representation("all", DeformationField, 2.2),
        "hexplane": Representation("all", HexPlaneField, 2.5),
        "vibration": Representation("all", Vibration, 1.0),
    }
)
"""What ``--representation`` takes: the paper's, then its baselines."""

# What a motion on disk may ask for: layers and levels cost time even before they have memory.
_LARGEST = {
    "depth": 64,
    "levels": 12,
    "position_frequencies": 30,
    "time_frequencies": 30,
    "track_times": 2000,
}
_LARGEST_OTHER = 1e5


def start_motion(config: MotionConfig, given: Start) -> tuple[Motion, Gaussians]:
    """The motion that ``config`` is of, before any step, and the Gaussians it moves; see ``Motion.start``."""
    motion = next(each for each in MOTIONS.values() if each.config_type is type(config))
    return motion.start(config, given)


def rebuilt(kind: str, values: dict[str, Any], state: dict[str, Tensor]) -> Motion:
    """The motion that had this kind, configuration and ``state_dict``, no longer learned.

    Raises:
        KeyError: No such kind.
        TypeError, ValueError, RuntimeError: Values or tensors do not belong to it.
    """
    for name, value in values.items():
        if not isinstance(value, int | float) or not abs(value) <= _LARGEST.get(name, _LARGEST_OTHER):
            raise ValueError(f"{name} of the motion is {value!r}")
    made = MOTIONS[kind]
    # Without memory until the stored tensors are known to be of the shapes that the values ask for.
    with torch.device("meta"):
        motion = made.blank(made.config_type(**values))
    _check_types(motion.state_dict(), state)
    motion.load_state_dict(state, assign=True)
    _check_values(motion)
    return motion.requires_grad_(False)


def _check_types(wanted: dict[str, Tensor], given: dict[str, Tensor]) -> None:
    for name, tensor in given.items():
        if name in wanted and wanted[name].dtype != tensor.dtype:
            raise ValueError(f"{name} of the motion is {tensor.dtype}, not {wanted[name].dtype}")


def _check_values(motion: Motion) -> None:
    """Whether times increase and space has a size."""
    state = motion.state_dict()
    for name in ("time_range_s", "track_times_s"):
        if name in state and not bool((torch.diff(state[name]) > 0).all()):
            raise ValueError(f"{name} of the motion does not increase")
    if "radius_m" in state and not float(state["radius_m"]) > 0:
        raise ValueError("the motion's radius_m is not positive")
    if "low_m" in state and not bool((state["high_m"] > state["low_m"]).all()):
        raise ValueError("the motion's box is empty")
