"""Losses of the street network, each over what is known of a picture."""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, UInt8
from torch import Tensor
from torch.nn import functional

from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.street_network.prediction import Prediction
from dreamdrive_train.street_network.data.records import DEPTH_STEPS, FAR, LABEL_SETS
from dreamdrive_train.street_network.targets import Batch

ALLOWED = torch.zeros(256, len(StreetClass), dtype=torch.bool)
for _label, _classes in LABEL_SETS.items():
    ALLOWED[_label, list(_classes)] = True


@dataclass(frozen=True)
class StreetLossOptions:
    """Weights of the parts of the loss; each part is of about one size."""

    classes: float = 1.0
    depth: float = 1.0
    far: float = 0.2
    gradient: float = 0.5
    """Of differences of log depth between neighbours, at four scales: edges stay sharp."""
    absolute: float = 0.3
    """Share of the depth loss in camera heights without alignment, where the height is known."""
    centre: float = 0.2
    offset: float = 0.2
    camera: float = 0.3
    distorted: float = 0.05
    taught_classes: float = 0.5
    taught_depth: float = 0.5
    trusted: float = 0.9
    """Least probability with which the teacher's class is taken."""
    class_weights: tuple[float, ...] = (0.6, 0.7, 1.5, 1.0, 0.8, 0.8, 2.5, 1.5, 4.0, 4.0, 1.0)
    """Of the pixels of each ``StreetClass``, rare ones more; a set of classes has that of its least."""


def losses(said: Prediction, batch: Batch, options: StreetLossOptions) -> dict[str, Float[Tensor, ""]]:
    """The parts of the loss, already weighted, of what is known of the pictures."""
    depth, gradient, far = depth_losses(said.log_depth, said.log_spread, batch, options.absolute)
    camera, distorted = camera_losses(said.camera, batch)
    parts = {
        "classes": class_loss(said.classes, batch.labels, options.class_weights),
        "depth": depth,
        "far": far,
        "gradient": gradient,
        "centre": centre_loss(said.centre, batch.centre, batch.centre_known),
        "offset": _mean((said.offset - batch.offset).abs().mean(dim=1) / 32, batch.on_road_user),
        "camera": camera,
        "distorted": distorted,
    }
    return {name: value * getattr(options, name) for name, value in parts.items()}


def class_loss(
    logits: Float[Tensor, "n 11 h w"], labels: UInt8[Tensor, "n h w"], weights: tuple[float, ...]
) -> Float[Tensor, ""]:
    """Minus the logarithm of the probability of the labels' sets; labels without a set say nothing."""
    allowed = ALLOWED.to(logits.device)
    weight = torch.tensor(weights, device=logits.device).expand(256, -1)
    weight = weight.masked_fill(~allowed, torch.inf).amin(dim=1)
    weight = weight.masked_fill(~torch.isfinite(weight), 0)[labels.long()]
    chance = functional.log_softmax(logits, dim=1)
    outside = (~allowed).T[:, labels.long()].transpose(0, 1)
    inside = chance.masked_fill(outside, -1e4).logsumexp(dim=1)
    return -(inside * weight).sum() / weight.sum().clamp(min=1)


def depth_losses(
    log_depth: Float[Tensor, "n h w"], log_spread: Float[Tensor, "n h w"], batch: Batch, absolute: float
) -> tuple[Float[Tensor, ""], Float[Tensor, ""], Float[Tensor, ""]]:
    """Of depth, of its differences between neighbours, and of what is far.

    Depth is compared after the median of a picture's errors is taken off; where the camera's height is known
    a share is compared as it is.
    """
    height = batch.camera_height_m
    in_heights = torch.isfinite(height)
    unit = torch.where(in_heights, height, 1.0).log()[:, None, None]
    known = (batch.depth_m > 0) & torch.isfinite(batch.depth_m)
    target = torch.where(known, batch.depth_m, 1.0).log() - unit
    error = log_depth - target
    with torch.no_grad():
        hidden = error.masked_fill(~known, torch.nan).flatten(1)
        shift = hidden.nanmedian(dim=1).values.nan_to_num()[:, None, None]
    aligned = _laplace(error - shift, log_spread)
    plain = _laplace(error, log_spread)
    share = absolute * in_heights[:, None, None]
    depth = _mean((1 - share) * aligned + share * plain, known)
    beyond = torch.isinf(batch.depth_m)
    near_by = (torch.tensor(FAR / DEPTH_STEPS).log() - unit + shift - log_depth).clamp(min=0)
    return depth, _gradient(error, known), _mean(near_by, beyond)


def _laplace(error: Float[Tensor, "n h w"], log_spread: Float[Tensor, "n h w"]) -> Float[Tensor, "n h w"]:
    """Negative logarithm of the density, by the root of the scale, so that the unsure is learned too.

    Seitzer et al. 2022, with beta = 0.5.
    """
    return (error.abs() * (-log_spread).exp() + log_spread) * (0.5 * log_spread.detach()).exp()


def _gradient(error: Float[Tensor, "n h w"], known: Bool[Tensor, "n h w"]) -> Float[Tensor, ""]:
    """Differences of errors between neighbours at four scales (Li and Snavely 2018)."""
    total = error.new_zeros(())
    for _ in range(4):
        across = (error[..., 1:] - error[..., :-1]).abs()
        down = (error[..., 1:, :] - error[..., :-1, :]).abs()
        total = total + _mean(across, known[..., 1:] & known[..., :-1])
        total = total + _mean(down, known[..., 1:, :] & known[..., :-1, :])
        error, known = error[..., ::2, ::2], known[..., ::2, ::2]
    return total / 8


def centre_loss(
    logits: Float[Tensor, "n 3 h w"], peaks: Float[Tensor, "n 3 h w"], known: Bool[Tensor, "n h w"]
) -> Float[Tensor, ""]:
    """Focal loss of centres, by the number of centres (Zhou et al. 2019)."""
    top = peaks == 1
    chance = logits.sigmoid()
    right = -((1 - chance) ** 2) * functional.logsigmoid(logits)
    wrong = -((1 - peaks) ** 4) * chance**2 * functional.logsigmoid(-logits)
    each = torch.where(top, right, wrong) * known[:, None]
    return each.sum() / (top & known[:, None]).sum().clamp(min=1)


def camera_losses(said: Float[Tensor, "n 7"], batch: Batch) -> tuple[Float[Tensor, ""], Float[Tensor, ""]]:
    """Of focal length, horizon and roll, by their stated spread, and of whether the lens distorts."""
    known = torch.isfinite(batch.camera)
    error = said[:, :3] - torch.where(known, batch.camera, 0.0)
    spread = said[:, 3:6].clamp(-5, 1)
    each = (0.5 * (error * (-spread).exp()) ** 2 + spread) * spread.detach().exp().sqrt()
    told = torch.isfinite(batch.distorted)
    wanted = torch.where(told, batch.distorted, 0.0)
    distorted = functional.binary_cross_entropy_with_logits(said[:, 6], wanted, reduction="none")
    return 3 * _mean(each, known), _mean(distorted, told)


def taught_losses(
    said: Prediction, teacher: Prediction, batch: Batch, options: StreetLossOptions
) -> dict[str, Float[Tensor, ""]]:
    """How far the pictures that are taught are from the teacher's answers, where nothing else is known.

    The teacher saw them unchanged in colour and mirrored; its answers are mirrored here.
    """
    rows = batch.taught
    chance, classes = teacher.classes.flip(3).softmax(dim=1).max(dim=1)
    unlabelled = ~ALLOWED.any(dim=1).to(rows.device)[batch.labels[rows].long()]
    wrong = functional.cross_entropy(said.classes[rows], classes, reduction="none")
    sure = unlabelled & (chance >= options.trusted)
    # By all pixels: a teacher that is hardly sure of anything then teaches hardly anything.
    by_class = (wrong * sure).sum() / unlabelled.sum().clamp(min=1)
    error = said.log_depth[rows] - teacher.log_depth.flip(2)
    with torch.no_grad():
        error_shift = error.flatten(1).median(dim=1).values[:, None, None]
        sky = classes == StreetClass.SKY
        trust = (-teacher.log_spread.flip(2)).exp().clamp(max=10) / 10
    open_depth = (batch.depth_m[rows] == 0) & ~sky
    by_depth = _mean((error - error_shift).abs() * trust, open_depth)
    return {
        "taught_classes": options.taught_classes * by_class,
        "taught_depth": options.taught_depth * by_depth,
    }


def _mean(values: Tensor, known: Tensor) -> Float[Tensor, ""]:
    """Of what is known; 0 where nothing is."""
    return torch.where(known, values, 0.0).sum() / known.sum().clamp(min=1)
