"""The static fit: everything optimised as if nothing moved (the scene behind eq. 5)."""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from jaxtyping import Float

from dreamdrive.compute.device import CPU
from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.fit.densify import Densifier
from dreamdrive.fit.exposure import ExposureNetwork
from dreamdrive.fit.memory import check_holds, size_of
from dreamdrive.fit.parameters import LearningRates, Parameters
from dreamdrive.fit.sky import estimate_sky
from dreamdrive.fit.trainer import FitOptions, Model, optimise
from dreamdrive.fit.views import training_views
from dreamdrive.progress import Progress
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.sky import Sky
from dreamdrive.splat import render


@dataclass(frozen=True)
class StaticFit:
    """G_init after the static fit; row i is still seed i.

    Attributes:
        gaussians: Optimised Gaussians.
        sky: The far background.
        exposure: Colour of the training frames.
    """

    gaussians: Gaussians
    sky: Sky
    exposure: Exposure

    def on(self, device: torch.device) -> "StaticFit":
        """The same with all its tensors on a device, where it is rendered then."""
        return StaticFit(self.gaussians.to(device), self.sky.on(device), self.exposure.on(device))

    def pictures(self, clip: Clip, geometry: Geometry) -> Callable[[int], Float[torch.Tensor, "h w 3"]]:
        """I_static of a frame (eq. 5) by its index, RGB in [0, 1] in the colours of the recording."""

        @one_torch_thread()
        @torch.no_grad()
        def picture(frame: int) -> Float[torch.Tensor, "h w 3"]:
            camera, t_s = geometry.cameras[frame], float(clip.times_s[frame])
            drawn = render(self.gaussians, camera)
            image = drawn.colour + (1 - drawn.alpha)[..., None] * self.sky.colour(camera)
            return self.exposure.apply(image, t_s, int(clip.camera[frame])).clamp(0, 1)

        return picture


def fit_static(
    clip: Clip,
    geometry: Geometry,
    gaussians: Gaussians,
    options: FitOptions,
    seed: int,
    progress: Progress,
    device: torch.device = CPU,
) -> StaticFit:
    """Optimise all seeds as static (eq. 5), without densification, so that rows keep their meaning.

    Held-out frames are not read. It is computed on ``device``; the result is on the CPU.

    Raises:
        InputError: The memory of a CUDA device cannot hold it.
    """
    check_holds(device, size_of(clip, gaussians, None, None, most=0))
    views = training_views(clip, geometry, device)
    static = Parameters(gaussians.to(device), footprints(gaussians).to(device), LearningRates())
    exposure = ExposureNetwork(len(clip), seed).to(device)
    model = Model(static, None, None, estimate_sky(clip, geometry), exposure)
    optimise(model, views, [Densifier()], options, seed, progress)
    return StaticFit(
        static.frozen(), model.sky, model.exposure.freeze(clip.times_s, ~clip.held_out, clip.camera)
    )


def footprints(gaussians: Gaussians) -> torch.Tensor:
    """Size of each seed in metres (N,), the unit of its moves: mean of its two largest log-scales."""
    return gaussians.log_scales.detach().topk(2, dim=1).values.mean(dim=1).exp()
