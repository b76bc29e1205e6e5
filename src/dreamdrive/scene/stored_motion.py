"""A motion on disk: what it is as JSON values, beside the tensors of its ``state_dict``."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
import torch
from torch import Tensor

from dreamdrive.scene.deformation import DeformationConfig, DeformationField, Domain, Tracks
from dreamdrive.scene.hexplane import Bounds, HexPlaneConfig, HexPlaneField
from dreamdrive.scene.motion import Motion
from dreamdrive.scene.vibration import Vibration, VibrationConfig

_KIND = "kind"
# What a motion on disk may ask for: layers and levels cost time even before they have memory.
_LARGEST = {
    "depth": 64,
    "levels": 12,
    "position_frequencies": 30,
    "time_frequencies": 30,
    "track_times": 2000,
}
_LARGEST_OTHER = 1e5


def described(motion: Motion) -> dict[str, Any]:
    """Its kind and configuration; a deformation field's goes without kind, as when it was the only one."""
    kind = {} if motion.kind == DeformationField.kind else {_KIND: motion.kind}
    return {**kind, **asdict(motion.config)}


def rebuilt(values: dict[str, Any], state: dict[str, Tensor]) -> Motion:
    """The motion that ``described`` and ``state_dict`` were taken of, no longer learned.

    Raises:
        KeyError: No such kind.
        TypeError, ValueError, RuntimeError: Values or tensors do not belong to it.
    """
    rest = dict(values)
    kind = rest.pop(_KIND, DeformationField.kind)
    for name, value in rest.items():
        if not isinstance(value, int | float) or not abs(value) <= _LARGEST.get(name, _LARGEST_OTHER):
            raise ValueError(f"{name} of the motion is {value!r}")
    # Without memory until the stored tensors are known to be of the shapes that the values ask for.
    with torch.device("meta"):
        motion = KINDS[kind](rest)
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


def _field(values: dict[str, Any]) -> DeformationField:
    """A deformation field with any valid values in it."""
    shape = DeformationConfig(**values)
    domain = Domain(np.zeros(3), 1.0, 0.0, 1.0, np.array([0.0, -1.0, 0.0]))
    actors, times = shape.actors, shape.track_times
    tracks = None
    if actors:
        moves, turns = np.zeros((actors, times, 3)), np.zeros((actors, times))
        tracks = Tracks(np.arange(times, dtype=np.float64), moves, turns, np.zeros((actors, 3)))
    return DeformationField(shape, domain, tracks)


def _planes(values: dict[str, Any]) -> HexPlaneField:
    return HexPlaneField(HexPlaneConfig(**values), Bounds(np.zeros(3), np.ones(3), 0.0, 1.0))


KINDS: dict[str, Callable[[dict[str, Any]], Motion]] = {
    DeformationField.kind: _field,
    HexPlaneField.kind: _planes,
    Vibration.kind: lambda values: Vibration(VibrationConfig(**values)),
}
"""How to rebuild each kind from its configuration, with any values in the tensors."""
