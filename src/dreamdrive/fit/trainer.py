"""The optimisation loop both fits share: render a frame, compare, step, densify."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import torch
from jaxtyping import Float, Int
from torch import Tensor

from dreamdrive import _native
from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.fit.activation import Activated, activate
from dreamdrive.fit.densify import Densifier
from dreamdrive.fit.exposure import ExposureNetwork, recorded_picture
from dreamdrive.fit.losses import LossName, geometry_loss, render_loss
from dreamdrive.fit.parameters import Parameters
from dreamdrive.fit.views import View, Views
from dreamdrive.motion import Motion
from dreamdrive.progress import Progress
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.render import Render
from dreamdrive.scene.sky import Sky
from dreamdrive.splat import seen_by

# Field of ``FitOptions`` that holds the step size of each of ``Motion.groups``.
RATES = {"network": "deformation_rate", "planes": "plane_rate", "tracks": "track_rate"}


@dataclass(frozen=True)
class FitOptions:
    """How long and against what a fit runs; what it is worth: docs/results/ablation.md.

    Attributes:
        steps: Optimisation steps, one frame each.
        least_visits: Steps for each training frame at least: longer clips take more than ``steps``.
        loss: Weights of L1 and SSIM, see ``losses.WEIGHTS``.
        sh_after: Share of the steps after which view-dependent colour is learned.
        depth_weight: Weight of the inverse-depth term (1/m).
        sky_weight: Weight of coverage in sky pixels: floaters cover the sky without it.
        solid_weight: Weight of what is uncovered where no sky is. A road that lets its backdrop through has
            holes from aside: at 0.05 views 2 m aside of drawn streets win 0.1 dB. Recorded roads look unlike
            in different places of a picture, which the backdrop can show: there some frames lose 1 dB.
        stray_weight: Weight of what dynamic Gaussians cover where nothing moves: they take the road along.
        warm_up: Share of the steps before the deformation network learns (Deformable-3DGS: 3,000 of 40,000).
        deformation_rate: Adam's step for the deformation network, decayed to a tenth.
        plane_rate: Adam's step for feature planes, decayed likewise: ten times the network's, as in 4D-GS.
        track_rate: Adam's step for actor tracks, in m and rad, decayed to a tenth: they are nearly right.
        exposure_rate: Adam's step for the exposure network.
    """

    steps: int
    least_visits: float = 0.0
    loss: LossName = "field"
    sh_after: float = 0.4
    depth_weight: float = 1.0
    sky_weight: float = 0.05
    solid_weight: float = 0.0
    stray_weight: float = 0.1
    warm_up: float = 0.1
    deformation_rate: float = 2e-3
    plane_rate: float = 2e-2
    track_rate: float = 2e-3
    exposure_rate: float = 1e-3


@dataclass(frozen=True)
class MovedPart:
    """The living Gaussians of a part at a step.

    Attributes:
        gaussians: As they are at the time (M, ...).
        rows: Which rows of the part they are (M,).
        penalty: What their motion adds to the loss, or None.
    """

    gaussians: Gaussians
    rows: Int[Tensor, " m"]
    penalty: Float[Tensor, ""] | None


@dataclass
class Model:
    """Everything a fit changes.

    Attributes:
        static: Gaussians free of time, or those of a per-frame street.
        dynamic: Gaussians that go through ``deformation``, or None.
        deformation: Present exactly when ``dynamic`` is.
        sky: The far background. It is an average over all frames already; learning it would cost a tenth of
            each step and change nothing that can be seen.
        exposure: Colour of each frame of the clip.
    """

    static: Parameters | None
    dynamic: Parameters | None
    deformation: Motion | None
    sky: Sky
    exposure: ExposureNetwork

    def moved(self, t_s: float, generator: torch.Generator) -> MovedPart | None:
        """The living dynamic Gaussians at a time, differentiable; None where nothing is dynamic."""
        if self.dynamic is None or self.deformation is None:
            return None
        whole = self.dynamic.gaussians().without_features()
        rows = whole.alive_at(t_s)
        # A copy of all rows, and another of their gradients, would be a twentieth of a step.
        living = whole if len(rows) == len(whole) else whole.select(rows)
        moved = self.deformation.training_at(living, t_s, generator)
        return MovedPart(moved, rows, self.deformation.penalty(living, moved))

    def street_at(self, t_s: float) -> MovedPart | None:
        """The living Gaussians of a per-frame street, differentiable; None of one that stands."""
        if self.static is None or not self.static.swinging:
            return None
        whole = self.static.gaussians().without_features()
        rows = whole.alive_at(t_s)
        return MovedPart(whole.select(rows).moved_to(t_s), rows, None)

    @property
    def device(self) -> torch.device:
        """Where it is computed."""
        return self.exposure.embedding.device

    def parts(self) -> list[Parameters]:
        """The present parameter sets, in the order in which they are splatted."""
        return [p for p in (self.static, self.dynamic) if p is not None]


class Trainer:
    """The state of a fit between two steps.

    Attributes:
        model: What changes.
        densifiers: One for each of ``model.parts()``.
        options: Length, rates and weights.
        generator: Source of the places of split Gaussians.
    """

    def __init__(
        self,
        model: Model,
        densifiers: Sequence[Densifier],
        options: FitOptions,
        generator: torch.Generator,
    ) -> None:
        _native.keep_freed_memory()
        self.model = model
        self.densifiers = densifiers
        self.options = options
        self.generator = generator
        self._optimiser = _shared_optimiser(model, options)

    def step(self, step: int, view: View, sky: Float[Tensor, "h w 3"]) -> Float[Tensor, ""]:
        """Render a frame, compare, learn and densify; the loss before that, on the device.

        ``step`` counts from 0, ``sky`` is what the view's camera sees of the sky alone.
        """
        model, options = self.model, self.options
        done = step / options.steps
        moved, street = model.moved(view.time_s, self.generator), model.street_at(view.time_s)
        timed = [part.gaussians for part in (street, moved) if part is not None]
        activated = activate(
            model.static if street is None else None, Gaussians.concatenate(*timed) if timed else None
        )
        standing = len(activated.means) - (0 if moved is None else len(moved.rows))
        offsets_px = torch.zeros(len(activated.means), 2, device=model.device, requires_grad=True)
        rendered = _splat(
            activated,
            view.camera,
            offsets_px,
            None if done >= options.sh_after else 0,
            _mark(activated.means, standing) if options.stray_weight else None,
        )
        loss = _loss(model, rendered, view, sky, options)
        if moved is not None and moved.penalty is not None:
            loss = loss + moved.penalty
        loss.backward()
        _decay(model, self._optimiser, options, done)
        _step(model, self._optimiser)
        self._observe(street, moved, standing, offsets_px, rendered)
        for part, densifier in zip(model.parts(), self.densifiers, strict=True):
            densifier.update(part, step, options.steps, self.generator)
        return loss.detach()

    def _observe(
        self,
        street: MovedPart | None,
        moved: MovedPart | None,
        standing: int,
        offsets_px: Tensor,
        rendered: Render,
    ) -> None:
        """Hand each part its share of the screen gradients; the first ``standing`` are the street's."""
        gradient = offsets_px.grad if offsets_px.grad is not None else torch.zeros_like(offsets_px)
        densifiers = iter(self.densifiers)
        if self.model.static is not None:
            rows = None if street is None else street.rows
            next(densifiers).observe(rows, gradient[:standing], rendered.visible[:standing])
        if moved is not None:
            next(densifiers).observe(moved.rows, gradient[standing:], rendered.visible[standing:])


# SSIM takes differences of squares, for which the ten bits of TF32 are too few.
@torch.backends.cudnn.flags(enabled=True, allow_tf32=False)
@one_torch_thread()
def optimise(
    model: Model,
    views: Views,
    densifiers: Sequence[Densifier],
    options: FitOptions,
    seed: int,
    progress: Progress,
) -> None:
    """Fit ``model`` in place to training frames.

    There is a densifier for each of ``model.parts()``; the seed decides the order of the frames and where
    split Gaussians come to lie.
    """
    # Of their own, so that how many Gaussians are split leaves the order of the frames as it is: with one for
    # both, a change of one thing in the input changed everything else in the scene.
    frame_order = torch.Generator("cpu").manual_seed(seed)
    trainer = Trainer(model, densifiers, options, torch.Generator("cpu").manual_seed(seed))
    behind = _sky_behind(model.sky, [view.camera for view in views], model.device)
    order: list[int] = []
    for step in range(options.steps):
        if not order:
            order = torch.randperm(len(views), generator=frame_order, device="cpu").tolist()
        which = order.pop()
        trainer.step(step, views[which].whole(), behind(which))
        progress(step + 1, options.steps)


def _sky_behind(
    sky: Sky, cameras: Sequence[Camera], device: torch.device
) -> Callable[[int], Float[Tensor, "h w 3"]]:
    """What each camera sees of the sky, by its number."""
    if device.type == "cpu":
        return [sky.colour(camera).contiguous() for camera in cameras].__getitem__
    # Drawn anew at each step: there it takes little time, but as much memory as all else of a view.
    there = replace(sky, texture=sky.texture.to(device))
    return lambda which: there.colour(cameras[which]).contiguous()


def _splat(
    activated: Activated,
    camera: Camera,
    offsets_px: Float[Tensor, "n 2"],
    sh_degree: int | None,
    channels: Float[Tensor, "n 1"] | None,
) -> Render:
    parameters = (getattr(activated, field.name) for field in fields(activated))
    return seen_by(camera, *parameters, screen_offsets_px=offsets_px, sh_degree=sh_degree, channels=channels)


def _mark(means: Float[Tensor, "n 3"], standing: int) -> Float[Tensor, "n 1"] | None:
    """0 for the first Gaussians, which stand, 1 for each dynamic one; None where there is one kind alone."""
    if standing in (0, len(means)):
        return None
    mark = torch.ones(len(means), 1, device=means.device)
    mark[:standing] = 0
    return mark


def _loss(
    model: Model,
    rendered: Render,
    view: View,
    sky: Float[Tensor, "h w 3"],
    options: FitOptions,
) -> Float[Tensor, ""]:
    image = recorded_picture(rendered.colour, rendered.alpha, sky, model.exposure(view.index))
    loss = render_loss(image, view.image, view.mask, options.loss) + geometry_loss(
        rendered.depth_m,
        rendered.alpha,
        view.depth_m,
        view.depth_weight,
        view.sky,
        options.depth_weight,
        options.sky_weight,
    )
    if options.solid_weight:
        loss = loss + options.solid_weight * ((1 - rendered.alpha) * view.solid).mean()
    if rendered.channels.shape[-1]:
        loss = loss + options.stray_weight * (rendered.channels[..., 0] * view.still).mean()
    return loss


def _shared_optimiser(model: Model, options: FitOptions) -> torch.optim.Adam:
    """Adam for what is not a set of Gaussians: deformation, tracks, exposure."""
    groups = [{"params": list(model.exposure.parameters()), "lr": options.exposure_rate, "name": "exposure"}]
    if model.deformation is not None:
        for name, learned in model.deformation.groups().items():
            groups.append({"params": learned, "lr": 0.0, "name": name})
    return torch.optim.Adam(groups, eps=1e-15, fused=True)


def _decay(model: Model, optimiser: torch.optim.Adam, options: FitOptions, done: float) -> None:
    for part in model.parts():
        part.set_progress(done)
    for group in optimiser.param_groups:
        if group["name"] in RATES:
            waits = group["name"] != "tracks" and done < options.warm_up
            group["lr"] = 0.0 if waits else getattr(options, RATES[group["name"]]) * 0.1**done
        elif group["name"] == "exposure":
            group["lr"] = options.exposure_rate * 0.1**done


def _step(model: Model, optimiser: torch.optim.Adam) -> None:
    for part in model.parts():
        part.step()
    optimiser.step()
    optimiser.zero_grad(set_to_none=True)
