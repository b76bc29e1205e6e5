"""A motion on disk: what it is as JSON values, beside the tensors of its ``state_dict``."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
from torch import Tensor

from dreamdrive.scene.deformation import DeformationConfig, DeformationField, Domain, Tracks
from dreamdrive.scene.hexplane import Bounds, HexPlaneConfig, HexPlaneField
from dreamdrive.scene.motion import Motion
from dreamdrive.scene.vibration import Vibration, VibrationConfig

_KIND = "kind"


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
    motion = KINDS[rest.pop(_KIND, DeformationField.kind)](rest)
    motion.load_state_dict(state)
    return motion.requires_grad_(False)


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
