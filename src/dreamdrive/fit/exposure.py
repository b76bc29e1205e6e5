"""The learned exposure of the recording camera, applied to rendered pictures."""

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

from dreamdrive import _native
from dreamdrive.compute.compiled import Gradients, Wanted, differentiable
from dreamdrive.compute.device import CPU, in_core
from dreamdrive.scene.exposure import Exposure, transform_colour


def recorded_picture(
    colour: Float[Tensor, "h w 3"],
    alpha: Float[Tensor, "h w"],
    sky: Float[Tensor, "h w 3"],
    affine: Float[Tensor, "3 4"],
) -> Float[Tensor, "h w 3"]:
    """What a camera records: ``transform_colour(colour + (1 - alpha) sky, affine)``, of float32 in one pass.

    Args:
        colour: Splatted colour without background.
        alpha: Share of each pixel that it covers.
        sky: What lies behind, without gradient.
        affine: The exposure.

    Raises:
        ValueError: The sky requires a gradient.
    """
    if sky.requires_grad:
        raise ValueError("sky: the recorded picture has no gradient for it; detach it")
    if not in_core(colour):
        return transform_colour(colour + (1 - alpha)[..., None] * sky, affine)
    return differentiable(_over_sky, colour, alpha, sky, affine)


def _over_sky(
    colour: Tensor, alpha: Tensor, sky: Tensor, affine: Tensor, *, wanted: Wanted
) -> tuple[Tensor, Gradients]:
    picture = torch.empty_like(colour)
    _native.over_sky(colour, alpha, sky, affine, picture)

    def gradients(upstream: Tensor) -> tuple[Tensor | None, ...]:
        d_colour, d_alpha, d_affine = (torch.empty_like(t) for t in (colour, alpha, affine))
        _native.over_sky_backward(colour, alpha, sky, affine, upstream, d_colour, d_alpha, d_affine)
        return d_colour, d_alpha, None, d_affine

    return picture, gradients


class ExposureNetwork(nn.Module):
    """Learns the exposure: a 4-d embedding a frame, a layer of 64, an affine transform around the identity.

    Only the last layer starts at zero. drivestudio zeroes every layer, and then nothing but the last bias can
    ever learn: one global correction instead of one a frame.
    """

    def __init__(self, frames: int, seed: int = 0) -> None:
        super().__init__()
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.embedding = nn.Parameter(torch.randn(frames, 4))
            self.hidden = nn.Linear(4, 64)
            self.output = nn.Linear(64, 12)
        nn.init.zeros_(self.output.weight)
        nn.init.zeros_(self.output.bias)

    def forward(self, frame_index: int) -> Float[Tensor, "3 4"]:
        """The affine colour transform of a frame."""
        change = self.output(torch.relu(self.hidden(self.embedding[frame_index])))
        return torch.eye(3, 4, dtype=change.dtype, device=change.device) + change.view(3, 4)

    @torch.no_grad()
    def freeze(
        self,
        times_s: Float[np.ndarray, " f"],
        trained: Bool[np.ndarray, " f"],
        camera: Int[np.ndarray, " f"] | None = None,
    ) -> Exposure:
        """The transforms of those of all frames, at ``times_s`` (F,) by ``camera``, that were trained on."""
        if len(times_s) != len(self.embedding):
            raise ValueError(f"exposure: {len(times_s)} times for {len(self.embedding)} frames")
        index = np.flatnonzero(trained)
        several = None if camera is None or not camera.any() else camera[index]
        transforms = torch.stack([self(int(i)) for i in index]).to(CPU, copy=True)
        return Exposure(transforms, np.asarray(times_s)[index], several)
