"""The network's prediction for a batch of pictures."""

from dataclasses import dataclass, replace

import torch
from jaxtyping import Float
from torch import Tensor


@dataclass(frozen=True)
class Prediction:
    """Of N pictures of H x W pixels, at half their size (h, w), at a quarter (h4, w4) and at an eighth.

    Attributes:
        log_depth: Natural logarithm of depth along z in camera heights above the road.
        log_spread: Logarithm of the scale of the Laplace distribution that ``log_depth`` is the middle of.
        classes: Logits of ``StreetClass``.
        centre: Logits of the centres of road users, a channel for each of ``ROAD_USERS``.
        offset: From each place to the centre of its road user, columns and rows in pixels of the picture.
        camera: log(focal length / W), horizon / W and roll in radians; then the logarithms of their standard
            deviations; then the logit of a strongly distorting lens. The horizon is counted as in ``Record``.
        features: What the answers are computed from.
    """

    log_depth: Float[Tensor, "n h w"]
    log_spread: Float[Tensor, "n h w"]
    classes: Float[Tensor, "n 11 h w"]
    centre: Float[Tensor, "n 3 h4 w4"]
    offset: Float[Tensor, "n 2 h4 w4"]
    camera: Float[Tensor, "n 7"]
    features: Float[Tensor, "n c h8 w8"] | None = None

    def to(self, device: torch.device) -> "Prediction":
        """The same on a device."""
        return replace(self, **{k: value.to(device) for k, value in vars(self).items() if value is not None})

    def of(self, index: int) -> "Prediction":
        """The answer for one of the pictures, as a batch of one."""
        only = slice(index, index + 1)
        return replace(self, **{name: value[only] for name, value in vars(self).items() if value is not None})
