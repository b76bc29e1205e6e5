"""The optimisation loop both fits share: render a frame, compare, step, densify."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.fit.densify import Densifier
from dreamdrive.fit.losses import LossName, disparity_loss, render_loss, shape_loss
from dreamdrive.fit.parameters import Parameters
from dreamdrive.fit.views import View
from dreamdrive.scene.deformation import DeformationField, alive_at
from dreamdrive.scene.exposure import ExposureNetwork, transform_colour
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.render import Render
from dreamdrive.scene.sky import Sky
from dreamdrive.splat import one_torch_thread, render

Progress = Callable[[int, int], None]

# Steps between two looks at the shapes, as in drivestudio: they change slowly and all of them are looked at.
SHAPE_EVERY = 10


@dataclass(frozen=True)
class FitOptions:
    """How long and against what a fit runs.

    Attributes:
        steps: Optimisation steps, one frame each.
        loss: Weights of L1 and SSIM, see ``losses.WEIGHTS``.
        half_size_share: Share of the steps, from the first, that look at half-size frames.
        sh_after: Share of the steps after which view-dependent colour is learned.
        depth_weight: Weight of the inverse-depth term (1/m), decayed to a tenth over the fit.
        sky_weight: Weight of coverage in sky pixels.
        shape_weight: Weight of ``shape_loss``, every ``SHAPE_EVERY`` steps.
        shape_ratio: Elongation that is free.
        warm_up: Share of the steps before the deformation network learns (Deformable-3DGS: 3,000 of 40,000).
        deformation_rate: Adam's step for the deformation network, decayed to a tenth.
        track_rate: Adam's step for actor tracks, in metres and radians, decayed to a tenth.
        exposure_rate: Adam's step for the exposure network.
    """

    steps: int
    loss: LossName = "field"
    half_size_share: float = 0.3
    sh_after: float = 0.4
    depth_weight: float = 0.5
    sky_weight: float = 0.05
    shape_weight: float = 0.2
    shape_ratio: float = 10.0
    warm_up: float = 0.1
    deformation_rate: float = 2e-3
    track_rate: float = 5e-3
    exposure_rate: float = 1e-3


@dataclass
class Model:
    """Everything a fit changes.

    Attributes:
        static: Gaussians free of time.
        dynamic: Gaussians that go through ``deformation``, or None.
        deformation: Present exactly when ``dynamic`` is.
        sky: The far background. It is an average over all frames already; learning it would cost a tenth of
            each step and change nothing that can be seen.
        exposure: Colour of each frame of the clip.
    """

    static: Parameters | None
    dynamic: Parameters | None
    deformation: DeformationField | None
    sky: Sky
    exposure: ExposureNetwork

    def at(self, t_s: float) -> tuple[Gaussians, list[Tensor]]:
        """What is there at a time, differentiable: the static Gaussians, then the living dynamic ones.

        The second value tells, for each of ``parts()``, which of its rows they are.
        """
        parts: list[Gaussians] = []
        rows: list[Tensor] = []
        if self.static is not None:
            parts.append(self.static.gaussians().without_features())
            rows.append(torch.arange(len(self.static)))
        if self.dynamic is not None and self.deformation is not None:
            whole = self.dynamic.gaussians().without_features()
            rows.append(alive_at(whole, t_s))
            parts.append(self.deformation.apply_at(whole.select(rows[-1]), t_s))
        return (Gaussians.concatenate(*parts) if len(parts) > 1 else parts[0]), rows

    def parts(self) -> list[Parameters]:
        """The present parameter sets in the order of ``at``."""
        return [p for p in (self.static, self.dynamic) if p is not None]


@one_torch_thread()
def optimise(
    model: Model,
    views: dict[int, list[View]],
    densifiers: Sequence[Densifier],
    options: FitOptions,
    seed: int,
    progress: Progress,
) -> None:
    """Fit ``model`` in place to the views.

    Args:
        model: What changes.
        views: The same training frames by how much they are shrunk: 1 and 2.
        densifiers: One for each of ``model.parts()``.
        options: Length, rates and weights.
        seed: Order of the frames and places of split Gaussians.
        progress: Called with steps done and steps in all.
    """
    generator = torch.Generator().manual_seed(seed)
    skies = {shrink: [model.sky.colour(v.camera) for v in shrunk] for shrink, shrunk in views.items()}
    optimiser = _shared_optimiser(model, options)
    order: list[int] = []
    for step in range(options.steps):
        done = step / options.steps
        if not order:
            order = torch.randperm(len(views[1]), generator=generator).tolist()
        shrink = 2 if done < options.half_size_share else 1
        which = order.pop()
        view = views[shrink][which]
        gaussians, rows = model.at(view.time_s)
        offsets_px = torch.zeros(len(gaussians), 2, requires_grad=True)
        degree = gaussians.sh_degree if done >= options.sh_after else 0
        rendered = render(gaussians, view.camera, screen_offsets_px=offsets_px, sh_degree=degree)
        loss = _loss(model, rendered, view, skies[shrink][which], options, done)
        if step % SHAPE_EVERY == 0:
            loss = loss + options.shape_weight * shape_loss(gaussians.log_scales, options.shape_ratio)
        loss.backward()
        _decay(model, optimiser, options, done)
        _step(model, optimiser)
        _observe(densifiers, rows, [len(p) for p in model.parts()], offsets_px, rendered, shrink)
        for part, densifier in zip(model.parts(), densifiers, strict=True):
            densifier.update(part, step, options.steps, generator)
        progress(step + 1, options.steps)


def _loss(
    model: Model,
    rendered: Render,
    view: View,
    sky: Float[Tensor, "h w 3"],
    options: FitOptions,
    done: float,
) -> Float[Tensor, ""]:
    image = rendered.colour + (1 - rendered.alpha)[..., None] * sky
    image = transform_colour(image, model.exposure(view.index))
    loss = render_loss(image, view.image, view.mask, options.loss)
    if options.depth_weight:
        weight = options.depth_weight * 0.1**done
        loss = loss + weight * disparity_loss(
            rendered.depth_m, rendered.alpha, view.depth_m, view.depth_weight
        )
    if options.sky_weight:
        loss = loss + options.sky_weight * (rendered.alpha * view.sky).mean()
    return loss


def _shared_optimiser(model: Model, options: FitOptions) -> torch.optim.Adam:
    """Adam for what is not a set of Gaussians: deformation, tracks, exposure."""
    groups = [{"params": list(model.exposure.parameters()), "lr": options.exposure_rate, "name": "exposure"}]
    if model.deformation is not None:
        named = dict(model.deformation.named_parameters())
        tracks = [named.pop(name) for name in ("track_translation", "track_yaw_rad")]
        groups.append({"params": list(named.values()), "lr": 0.0, "name": "network"})
        groups.append({"params": tracks, "lr": 0.0, "name": "tracks"})
    return torch.optim.Adam(groups, eps=1e-15, fused=True)


def _decay(model: Model, optimiser: torch.optim.Adam, options: FitOptions, done: float) -> None:
    for part in model.parts():
        part.set_progress(done)
    moving = 0.1**done if done >= options.warm_up else 0.0
    for group in optimiser.param_groups:
        if group["name"] == "network":
            group["lr"] = options.deformation_rate * moving
        elif group["name"] == "tracks":
            group["lr"] = options.track_rate * 0.1**done


def _step(model: Model, optimiser: torch.optim.Adam) -> None:
    for part in model.parts():
        part.step()
    optimiser.step()
    optimiser.zero_grad(set_to_none=True)


def _observe(
    densifiers: Sequence[Densifier],
    rows: list[Tensor],
    counts: list[int],
    offsets_px: Tensor,
    rendered: Render,
    shrink: int,
) -> None:
    """Hand each part its share of the screen gradients, those of absent rows being zero."""
    # A pixel of a half-size frame is two pixels wide.
    gradient = (offsets_px.grad if offsets_px.grad is not None else torch.zeros_like(offsets_px)) / shrink
    start = 0
    for densifier, present, count in zip(densifiers, rows, counts, strict=True):
        here = slice(start, start + len(present))
        whole = torch.zeros(count, 2).index_copy_(0, present, gradient[here])
        seen = torch.zeros(count, dtype=torch.bool).index_copy_(0, present, rendered.visible[here])
        densifier.observe(whole, seen)
        start += len(present)
