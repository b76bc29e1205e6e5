"""What a file of Gaussians holds, before it is known that all of it can be drawn."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import FARTHEST_M
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.harmonics import sh_rotation

MOST_GAUSSIANS = 20_000_000
"""Gaussians that a file may hold: 5 GB with all their colours."""
UP_AND_BACK = np.diag([1.0, -1.0, -1.0])
"""From x right, y down, z ahead to x right, y up, z back, the axes of SPZ, glTF and USD; its own inverse."""
_FEW, _MOST_A_BYTE = 10_000, 4
"""Compressed, a Gaussian takes at least two bytes; what claims many more would fill the memory."""
_MOST_LOGIT, _MOST_LOG_SCALE = 20.0, 40.0
_LENGTHS = 1e-6, 1e6
_BRIGHTEST = 1e6


@dataclass(frozen=True)
class Splats:
    """N Gaussians as numbers of a file; any of them may be NaN or infinite.

    Attributes:
        means: Centres (N, 3).
        quaternions: Rotations (N, 4), wxyz.
        log_scales: Logarithms of the deviations (N, 3).
        logit_opacities: (N,).
        sh: Colour (N, K, 3), as in ``Gaussians``.
    """

    means: Float[np.ndarray, "n 3"]
    quaternions: Float[np.ndarray, "n 4"]
    log_scales: Float[np.ndarray, "n 3"]
    logit_opacities: Float[np.ndarray, " n"]
    sh: Float[np.ndarray, "n k 3"]

    def gaussians(self, where: str) -> tuple[Gaussians, int]:
        """Those that can be drawn, and how many cannot: with NaN, too far, too large or without rotation.

        Raises:
            InputError: None can be drawn.
        """
        logits = np.clip(self.logit_opacities, -_MOST_LOGIT, _MOST_LOGIT)
        sizes = np.maximum(self.log_scales, -_MOST_LOG_SCALE)
        with np.errstate(invalid="ignore", over="ignore"):
            lengths = np.linalg.norm(self.quaternions, axis=1)
            good = (np.abs(self.means) <= FARTHEST_M).all(axis=1) & np.isfinite(logits)
            good &= (lengths >= _LENGTHS[0]) & (lengths <= _LENGTHS[1])
            good &= (sizes <= _MOST_LOG_SCALE).all(axis=1) & (np.abs(self.sh) <= _BRIGHTEST).all(axis=(1, 2))
        if not good.any():
            raise InputError(f"{where}: none of its {len(good)} Gaussians can be drawn; are these numbers?")
        arrays = self.means, self.quaternions, sizes, logits, self.sh
        kept = [torch.from_numpy(np.ascontiguousarray(each[good], np.float32)) for each in arrays]
        frame = torch.zeros(len(kept[0]), dtype=torch.int64)
        return Gaussians(*kept, source_frame=frame), int((~good).sum())


def check_count(count: int, size: int, where: str) -> None:
    """Raise ``InputError`` where a file of ``size`` bytes claims to hold none, or more than can be meant."""
    if not 0 < count <= MOST_GAUSSIANS:
        raise InputError(f"{where} holds {count} Gaussians; expected 1 to {MOST_GAUSSIANS}")
    if count > _FEW and count > _MOST_A_BYTE * size:
        raise InputError(f"{where} says that it holds {count} Gaussians, in {size} bytes: it is damaged")


def turned(gaussians: Gaussians, rotation: Float[np.ndarray, "3 3"]) -> Gaussians:
    """The Gaussians in a frame that is turned by a rotation: R x in place of x, with their colours."""
    w, x, y, z = np.roll(Rotation.from_matrix(rotation).as_quat(), 1).tolist()
    by = gaussians.quaternions.new_tensor([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    colours = sh_rotation(rotation, gaussians.sh_degree)
    return Gaussians(
        means=gaussians.means @ gaussians.means.new_tensor(rotation).T,
        quaternions=gaussians.quaternions @ by.T,
        log_scales=gaussians.log_scales,
        logit_opacities=gaussians.logit_opacities,
        sh=torch.einsum("ij,njc->nic", gaussians.sh.new_tensor(colours), gaussians.sh),
        source_frame=gaussians.source_frame,
    )


def arrays_of(gaussians: Gaussians, rotation: Float[np.ndarray, "3 3"] | None = None) -> Splats:
    """Gaussians as numbers to write, turned if asked for; quaternions have unit length."""
    there = gaussians if rotation is None else turned(gaussians, rotation)
    names = "means", "quaternions", "log_scales", "logit_opacities", "sh"
    means, quaternions, *rest = (getattr(there, name).numpy(force=True) for name in names)
    return Splats(means, quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True), *rest)
