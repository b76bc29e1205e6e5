"""From what is known of a block of pixels to the error to expect there: a small network that ships."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import safetensors.numpy
from jaxtyping import Float

from dreamdrive.splat import SceneView
from dreamdrive.vision.residual import blocks

CALIBRATED = Path(__file__).with_name("calibrated.safetensors")
"""Of drawn streets, see ``benchmarks/trust.py``."""
MOST = 0.15
"""Squared error of what is all wrong."""
FEATURES = (
    "error",
    "angle",
    "ratio",
    "gradient",
    "contrast",
    "edge",
    "relief",
    "closer",
    "unseen",
    "moving",
    "empty",
    "near",
    "hidden",
)
RISING = tuple(name not in ("moving", "near") for name in FEATURES)
"""Of which more never means less error: chosen, so that streets unlike the drawn ones do not surprise."""
_AROUND_PX = (15, 15)


@dataclass(frozen=True)
class ErrorNetwork:
    """A layer of H hyperbolic tangents over the F standardised features, and their sum.

    Attributes:
        mean: Of each feature over the streets it was fitted to (F,).
        deviation: Likewise (F,).
        weights: From features to the layer (F, H), none below 0 for those in ``RISING``.
        bias: Of the layer (H,).
        out: From the layer to the logit of the squared error over ``MOST`` (H,), none below 0.
        base: Its constant (1,).
    """

    mean: Float[np.ndarray, " f"]
    deviation: Float[np.ndarray, " f"]
    weights: Float[np.ndarray, "f h"]
    bias: Float[np.ndarray, " h"]
    out: Float[np.ndarray, " h"]
    base: Float[np.ndarray, "1"]

    def squared_error(self, features: Float[np.ndarray, "*n f"]) -> Float[np.ndarray, "*n"]:
        """To expect of each block, in (0, ``MOST``)."""
        layer = np.tanh((features - self.mean) / self.deviation @ self.weights + self.bias)
        return MOST / (1 + np.exp(-(layer @ self.out + self.base[0])))


@cache
def error_network() -> ErrorNetwork:
    """The one that ships."""
    return ErrorNetwork(**safetensors.numpy.load_file(CALIBRATED))


def features_of(
    view: SceneView, told: Float[np.ndarray, "h w c"], hidden: Float[np.ndarray, "bh bw"]
) -> Float[np.ndarray, "bh bw f"]:
    """``FEATURES`` of each block of a view.

    Args:
        view: What is shown.
        told: What ``evidence.seen_with`` tells of its pixels.
        hidden: What ``FreeSpace.hidden`` tells of its blocks.
    """
    depth_m = view.depth_m.numpy()
    inverse = np.where(depth_m > 0, 1 / np.maximum(depth_m, 0.3), 0).astype(np.float32)
    grey = view.colour.numpy().mean(axis=-1)
    slopes = _slope(grey, 1, 0) ** 2 + _slope(grey, 0, 1) ** 2
    pixels = [
        slopes,
        _variance(grey),
        np.abs(_slope(inverse, 1, 0)),
        _variance(inverse),
        view.dynamic_share.numpy(),
        1 - view.alpha.numpy(),
        inverse,
    ]
    gradient, contrast, edge, relief, moving, empty, near = np.moveaxis(
        blocks(np.stack(pixels, axis=-1)), -1, 0
    )
    error, unseen, angle, closer, ratio = np.moveaxis(blocks(told), -1, 0)
    of_blocks = {
        "error": np.log(error**2 + 1e-4),
        "angle": np.log(angle + 0.003),
        "ratio": np.log(ratio + 0.02),
        "gradient": np.log(gradient + 1e-5),
        "contrast": np.log(contrast + 1e-4),
        "edge": np.log(edge + 1e-4),
        "relief": np.log(relief + 1e-5),
        "closer": closer,
        "unseen": unseen,
        "moving": moving,
        "empty": empty,
        "near": np.log(near + 0.01),
        "hidden": hidden,
    }
    return np.stack([of_blocks[name] for name in FEATURES], axis=-1)


def _slope(values: Float[np.ndarray, "h w"], across: int, down: int) -> Float[np.ndarray, "h w"]:
    """Change a pixel."""
    return cv2.Sobel(values, cv2.CV_32F, across, down, ksize=3) / 8


def _variance(values: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
    """Around each pixel."""
    mean = cv2.blur(values, _AROUND_PX)
    return np.maximum(cv2.blur(values**2, _AROUND_PX) - mean**2, 0)
