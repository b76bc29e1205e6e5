"""Squares around what was filled, and features of a network that no training used."""

import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8

from dreamdrive.evaluate.networks import stlpips

SIDE_PX = 64
_STEP_PX = 32
_LEAST = 0.2
"""Share of a square that was filled."""


def squares_of(
    rgb: UInt8[np.ndarray, "h w 3"], region: Bool[np.ndarray, "h w"]
) -> list[UInt8[np.ndarray, "s s 3"]]:
    """All squares of a grid of which much was filled."""
    found: list[np.ndarray] = []
    for top in range(0, region.shape[0] - SIDE_PX + 1, _STEP_PX):
        for left in range(0, region.shape[1] - SIDE_PX + 1, _STEP_PX):
            square = np.s_[top : top + SIDE_PX, left : left + SIDE_PX]
            if region[square].mean() >= _LEAST:
                found.append(rgb[square])
    return found


def features_of(squares: list[UInt8[np.ndarray, "s s 3"]]) -> Float[np.ndarray, "n c"]:
    """Means over each square of the second and last values of stlpips-alex's trunk."""
    trunk = stlpips.load_stlpips("alex").trunk
    rows: list[torch.Tensor] = []
    with torch.inference_mode():
        for start in range(0, len(squares), 32):
            batch = torch.from_numpy(np.stack(squares[start : start + 32])).permute(0, 3, 1, 2).float()
            taps = trunk(batch / 127.5 - 1)
            rows.append(torch.cat([taps[1].mean((2, 3)), taps[-1].mean((2, 3))], 1))
    return torch.cat(rows).double().numpy()
