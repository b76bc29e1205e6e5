"""A training step written with the pieces torch offers; only the splat is ours.

It is the peer of the real step, and the reference its tests compare with.
"""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from dreamdrive.fit import WEIGHTS, FitOptions, LearningRates, LossName, Model, Parameters, View
from dreamdrive.motion import DeformationField
from dreamdrive.scene.exposure import transform_colour
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.splat import render, ssim_map_reference

LEAVES = ("offsets", "quaternions", "log_scales", "logit_opacities", "sh_dc", "sh_rest")


def over_sky(
    colour: Float[Tensor, "h w 3"],
    alpha: Float[Tensor, "h w"],
    sky: Float[Tensor, "h w 3"],
    affine: Float[Tensor, "3 4"],
) -> Float[Tensor, "h w 3"]:
    """Twin of ``recorded_picture``."""
    return transform_colour(colour + (1 - alpha)[..., None] * sky, affine)


def render_loss(
    image: Float[Tensor, "h w 3"],
    reference: Float[Tensor, "h w 3"],
    mask: Bool[Tensor, "h w"],
    name: LossName,
) -> Float[Tensor, ""]:
    """Twin of ``losses.render_loss``."""
    image = torch.where(mask[..., None], image, reference)
    weight_l1, weight_ssim = WEIGHTS[name]
    l1 = (image - reference).abs().mean()
    return weight_l1 * l1 + weight_ssim * (1 - ssim_map_reference(image, reference).mean())


def geometry_loss(
    depth_sum: Float[Tensor, "h w"],
    alpha: Float[Tensor, "h w"],
    reference_m: Float[Tensor, "h w"],
    weight: Float[Tensor, "h w"],
    sky: Bool[Tensor, "h w"],
    disparity_weight: float,
    sky_weight: float,
) -> Float[Tensor, ""]:
    """Twin of ``losses.geometry_loss``."""
    inverse = alpha.clamp(min=1e-3) / depth_sum.clamp(min=1e-3)
    target = torch.where(weight > 0, 1 / reference_m.clamp(min=1e-3), inverse.detach())
    disparity = (weight * (inverse - target).abs()).sum() / weight.sum().clamp(min=1.0)
    return disparity_weight * disparity + sky_weight * (alpha * sky).mean()


def posed(field: DeformationField, gaussians: Gaussians, t_s: float) -> Gaussians:
    """Twin of ``DeformationField.apply_at`` for any floating type."""
    offsets = field(gaussians.means, gaussians.quaternions, gaussians.actor, t_s)
    unit = torch.nn.functional.normalize(gaussians.quaternions, dim=-1)
    fields = gaussians.tensors() | {
        "means": gaussians.means + offsets.mean_m,
        "quaternions": unit + offsets.quaternion,
        "log_scales": gaussians.log_scales + offsets.log_scale,
    }
    return Gaussians(**fields).faded_at(t_s)


class PlainLeaves:
    """Twin of ``Parameters`` without surgery."""

    def __init__(self, start: Parameters) -> None:
        self.start = start.frozen()
        self.anchors, self.unit_m = start.anchors.clone(), start.unit_m.clone()
        split = {"sh_dc": start.sh[:, :1], "sh_rest": start.sh[:, 1:]}
        for name in LEAVES:
            value = split.get(name, getattr(start, name, None))
            setattr(self, name, value.detach().clone().requires_grad_())
        groups = [
            {"params": [getattr(self, name)], "lr": getattr(start.rates, name), "name": name}
            for name in LEAVES
        ]
        self.optimiser = torch.optim.Adam(groups, eps=1e-15)

    def gaussians(self) -> Gaussians:
        """The Gaussians as they are now."""
        fields = self.start.without_features().tensors() | {
            "means": self.anchors + self.unit_m[:, None] * self.offsets,
            "quaternions": self.quaternions,
            "log_scales": self.log_scales,
            "logit_opacities": self.logit_opacities,
            "sh": torch.cat([self.sh_dc, self.sh_rest], dim=1),
        }
        return Gaussians(**fields)

    def set_progress(self, done: float) -> None:
        """Decay the steps."""
        rates = LearningRates()
        of_positions, of_others = rates.shares(done)
        for group in self.optimiser.param_groups:
            share = of_positions if group["name"] == "offsets" else of_others
            group["lr"] = getattr(rates, group["name"]) * share


class PlainTrainer:
    """Twin of ``Trainer``; densification statistics are kept, densification itself is left out."""

    def __init__(self, model: Model, options: FitOptions) -> None:
        self.options, self.field, self.exposure = options, model.deformation, model.exposure
        self.static, self.dynamic = PlainLeaves(model.static), PlainLeaves(model.dynamic)
        named = dict(self.field.named_parameters())
        tracks = [named.pop(name) for name in ("track_translation", "track_yaw_rad")]
        self.shared = torch.optim.Adam(
            [
                {"params": list(self.exposure.parameters()), "lr": options.exposure_rate},
                {"params": list(named.values()), "lr": 0.0},
                {"params": tracks, "lr": 0.0},
            ],
            eps=1e-15,
        )
        self.pull = torch.zeros(len(self.static.anchors) + len(self.dynamic.anchors))
        self.seen = torch.zeros_like(self.pull)

    def step(self, step: int, view: View, sky: Float[Tensor, "h w 3"]) -> None:
        """Render a frame, compare, learn."""
        options = self.options
        done = step / options.steps
        dynamic = self.dynamic.gaussians()
        rows = dynamic.alive_at(view.time_s)
        moved = posed(self.field, dynamic.select(rows), view.time_s)
        gaussians = Gaussians.concatenate(self.static.gaussians(), moved)
        offsets_px = torch.zeros(len(gaussians), 2, requires_grad=True)
        degree = gaussians.sh_degree if done >= options.sh_after else 0
        moves = (torch.arange(len(gaussians)) >= len(self.static.anchors)).float()
        rendered = render(
            gaussians,
            view.camera,
            channels=moves[:, None],
            screen_offsets_px=offsets_px,
            sh_degree=degree,
        )
        image = over_sky(rendered.colour, rendered.alpha, sky, self.exposure(view.index))
        loss = render_loss(image, view.image, view.mask, options.loss)
        weights = options.depth_weight * 0.1**done, options.sky_weight
        loss = loss + geometry_loss(
            rendered.depth_m, rendered.alpha, view.depth_m, view.depth_weight, view.sky, *weights
        )
        if options.solid_weight:
            loss = loss + options.solid_weight * ((1 - rendered.alpha) * view.solid).mean()
        loss = loss + options.stray_weight * (rendered.channels[..., 0] * view.still).mean()
        loss.backward()
        moving = 0.1**done if done >= options.warm_up else 0.0
        self.shared.param_groups[0]["lr"] = options.exposure_rate * 0.1**done
        self.shared.param_groups[1]["lr"] = options.deformation_rate * moving
        self.shared.param_groups[2]["lr"] = options.track_rate * 0.1**done
        for part in (self.static, self.dynamic):
            part.set_progress(done)
            part.optimiser.step()
            part.optimiser.zero_grad()
        self.shared.step()
        self.shared.zero_grad()
        static = len(self.static.anchors)
        half_size = torch.tensor([view.camera.width_px / 2, view.camera.height_px / 2])
        index = torch.cat([torch.arange(static), static + rows])
        self.pull[index] += torch.linalg.vector_norm(offsets_px.grad * half_size, dim=1)
        self.seen[index] += rendered.visible
