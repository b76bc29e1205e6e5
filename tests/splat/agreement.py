"""Whether two renders of one scene agree, pixel by pixel and Gaussian by Gaussian.

Splatting is not continuous: an alpha at 1/255 counts or not, the Gaussian that takes the transmittance to
1e-4 ends its pixel, and gradients jump where alpha is capped; float32 and float64 fall on different sides
there. So pixels within rounding of such an edge are found in float64. No gradient is pulled through them, and
their value may differ by what the edge is worth, and no more. Everything else has to agree to rounding.
"""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from dreamdrive.scene.render import Render
from dreamdrive.splat import rasterize
from dreamdrive.splat.reference import (
    MAX_ALPHA,
    MIN_ALPHA,
    MIN_TRANSMITTANCE,
    colours,
    compositing_weights,
    offsets_from,
    project,
)
from tests.splat.drawn import Case, arguments
from tests.splat.scenes import IMAGES

EDGE = 1e-3  # relative error of alpha that rounding of a float32 projection may cause
CAP_EDGE = 1e-4  # the same at the cap, where the power is nearly zero
VALUE = 5e-4  # error of a pixel, as a share of the sum of its parts' magnitudes
TOTAL = 1e-4  # error of an image, as a share of its norm
ROW = 5e-3  # error of one Gaussian's gradient, as a share of its length
ROUNDING = 5e-7  # of float32: more error of that gradient for each unit of its footprint's condition number
FLOOR = 0.01  # of the root mean square over all Gaussians, added to that length

Gradients = dict[str, Tensor]


@dataclass(frozen=True)
class Edges:
    """Where a scene's image is not smooth.

    Attributes:
        sure: Pixels (H, W) away from every edge.
        jump: Weight (H, W) that may come or go at an edge.
        reaching: Gaussians (N,) that certainly reach a pixel.
        near: Gaussians (N, H, W) that reach a pixel or nearly do.
        half_sure: Pixels (H, W) where it is certain which Gaussian covers the second half.
        magnitudes: Sums of the magnitudes of what is added, of the shape of each image.
        largest: Largest magnitude of what is composited, by image.
        condition: Longer over shorter axis of each footprint, squared (N,); 0 for what is not projected.
        lengths: Typical length of each row's gradient, by tensor.
    """

    sure: Tensor
    jump: Tensor
    reaching: Tensor
    near: Tensor
    half_sure: Tensor
    magnitudes: dict[str, Tensor]
    largest: dict[str, float]
    condition: Tensor
    lengths: dict[str, Tensor]

    def cropped(self, rows: slice, columns: slice) -> "Edges":
        """The edges of a part of the image."""
        parts = {name: value[rows, columns] for name, value in self.magnitudes.items()}
        at = (..., rows, columns)
        return replace(
            self,
            sure=self.sure[at],
            jump=self.jump[at],
            near=self.near[at],
            half_sure=self.half_sure[at],
            magnitudes=parts,
        )


def edges(case: Case, scene: dict[str, Tensor]) -> Edges:
    """Find the edges in float64."""
    splat, (width, height) = arguments(case, scene), case.size_px
    index, centre, conic, opacities, depth = project(splat)
    dx, dy = offsets_from(centre, None, case.size_px)
    sigma = 0.5 * (conic[:, 0] * dx**2 + conic[:, 2] * dy**2) + conic[:, 1] * dx * dy
    raw = opacities * torch.exp(-sigma)
    alpha = torch.where(raw >= MIN_ALPHA, raw.clamp(max=MAX_ALPHA), 0.0)
    after = torch.cumprod(1 - alpha, 1)
    before = torch.cat([torch.ones_like(after[:, :1]), after[:, :-1]], 1)
    in_or_out = (raw / MIN_ALPHA - 1).abs() < EDGE
    # Each Gaussian that comes or goes changes the transmittance behind it by a share of 1/255.
    share = EDGE + 1.1 * MIN_ALPHA * in_or_out.sum(1, keepdim=True)
    live = before > MIN_TRANSMITTANCE * (1 - share)
    last_or_not = (after / MIN_TRANSMITTANCE - 1).abs() < 10 * share
    jumping, capped = live & (in_or_out | last_or_not), live & ((raw / MAX_ALPHA - 1).abs() < CAP_EDGE)
    half_in_doubt = ((after / 0.5 - 1).abs() < 10 * share).any(1)
    trace, determinant = conic[:, 0] + conic[:, 2], conic[:, 0] * conic[:, 2] - conic[:, 1] ** 2
    n = len(scene["means"])
    near, condition = torch.zeros(n, height, width, dtype=torch.bool), torch.zeros(n, dtype=torch.float64)
    near[index] = (raw > (1 - EDGE) * MIN_ALPHA).T.reshape(-1, height, width)
    condition[index] = trace**2 / determinant
    reaching = torch.zeros(n, dtype=torch.bool)
    reaching[index] = (raw > (1 + EDGE) * MIN_ALPHA).any(0)
    weights, _ = compositing_weights(dx, dy, conic, opacities)
    values = {"colour": colours(splat, index), "alpha": torch.ones(len(index), 1), "depth_m": depth[:, None]}
    values["channels"] = depth.new_zeros(len(index), 0) if splat.channels is None else splat.channels[index]
    sure = ~(jumping | capped).any(1).reshape(height, width)
    return Edges(
        sure=sure,
        jump=(jumping * before * raw).sum(1).reshape(height, width),
        reaching=reaching,
        near=near,
        half_sure=sure & ~half_in_doubt.reshape(height, width),
        magnitudes={k: (weights @ v.double().abs()).reshape(height, width, -1) for k, v in values.items()},
        largest={k: v.abs().max().item() if v.numel() else 0.0 for k, v in values.items()},
        condition=condition,
        lengths=_lengths(case, scene, sure),
    )


def _lengths(case: Case, scene: dict[str, Tensor], sure: Tensor) -> dict[str, Tensor]:
    """Root mean square over random upstream gradients: of a single one, a row may cancel by chance."""
    draws = [pull(case, scene, sure, "reference", seed=seed)[1] for seed in range(3)]
    for draw in draws:  # turning a nearly round Gaussian is a small difference of large gradients
        by_log_scale = (draw["scales"] * scene["scales"]).norm(dim=1, keepdim=True)
        turned = by_log_scale / scene["quaternions"].norm(dim=1, keepdim=True)
        draw["quaternions"] = torch.cat([draw["quaternions"], turned], 1)
    rows = {name: torch.stack([_rows(draw[name]) for draw in draws]) for name in scene}
    return {name: row.square().sum(2).mean(0).sqrt() for name, row in rows.items()}


def _rows(values: Tensor) -> Tensor:
    """As a matrix (N, the rest), whatever is empty."""
    return values.reshape(len(values), values.shape[1:].numel())


def pull(
    case: Case,
    scene: dict[str, Tensor],
    sure: Tensor,
    backend: str = "native",
    factor: float = 1,
    seed: int = 7,
) -> tuple[Render, Gradients]:
    """Render, and pull a random gradient times ``factor`` back through the sure pixels."""
    dtype = torch.float32 if backend == "native" else torch.float64
    inputs = {name: value.to(dtype).clone().requires_grad_() for name, value in scene.items()}
    options = {"sh_degree": case.degree, "antialiased": case.antialiased, "inspect": case.inspect}
    out = rasterize(**inputs, **case.camera(), **options, backend=backend)
    g = torch.Generator().manual_seed(seed)
    loss = torch.zeros((), dtype=dtype)
    for name in IMAGES:
        image = getattr(out, name)
        upstream = torch.randn(image.shape, generator=g, dtype=torch.float64) * factor
        kept = sure if image.ndim == 2 else sure[..., None]
        if name in case.pulled:
            loss = loss + (image * (upstream * kept).to(dtype)).sum()
    loss.backward()
    return out, {k: torch.zeros_like(v) if v.grad is None else v.grad for k, v in inputs.items()}


def assert_images_agree(value: Render, expected: Render, where: Edges) -> None:
    """Equal to rounding on sure pixels; elsewhere not further apart than the edges there allow."""
    for name in IMAGES:
        a, b = getattr(value, name).double(), getattr(expected, name).double()
        assert torch.isfinite(a).all(), name
        if not a.numel():
            continue
        a, b = (image.reshape(*where.sure.shape, -1) for image in (a, b))
        allowed = VALUE * where.magnitudes[name] + 1e-6 * where.largest[name] + 1e-9
        error = (a - b).abs()
        wrong = (error > allowed) & where.sure[..., None]
        assert not wrong.any(), f"{name}: off by {error[wrong].max():.3g} on {wrong.sum()} values"
        wrong = error > allowed + 2.2 * where.largest[name] * where.jump[..., None]
        assert not wrong.any(), f"{name}: jumps by {error[wrong].max():.3g} at an edge"
        assert error[where.sure].norm() <= TOTAL * b[where.sure].norm() + 1e-9, name


def assert_inspections_agree(value: Render, expected: Render, where: Edges) -> None:
    """Median depth and weights of the Gaussians."""
    depths = (render.median_depth_m[where.half_sure].double() for render in (value, expected))
    torch.testing.assert_close(*depths, rtol=1e-4, atol=0)
    jump = (where.near * where.jump).flatten(1)
    for name, jumps in (("weight_sum_px", jump.sum(1)), ("weight_most", jump.amax(1))):
        a, b = getattr(value, name).double(), getattr(expected, name).double()
        wrong = (a - b).abs() > 1e-3 * b + 2.2 * jumps + 1e-6
        assert not wrong.any(), f"{name}: {a[wrong].tolist()}, expected {b[wrong].tolist()}"


def assert_gradients_agree(value: Gradients, expected: Gradients, where: Edges) -> None:
    """Each Gaussian's gradient agrees, however small beside the others'."""
    for name, gradient in value.items():
        a, b = _rows(gradient.double()), _rows(expected[name].double())
        assert torch.isfinite(a).all(), name
        if not a.numel():
            continue
        length = where.lengths[name]
        floor = FLOOR * length.square().mean().sqrt()
        whole = name == "camera_from_world"
        condition = max(where.condition.tolist(), default=0) if whole else where.condition
        allowed = (ROW + ROUNDING * condition) * (length + floor + 1e-9)
        excess = (a - b).norm(dim=1) / allowed
        row = int(excess.argmax())
        assert excess[row] < 1, f"{name}: row {row} is {a[row].tolist()}, expected {b[row].tolist()}"
