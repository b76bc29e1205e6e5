"""Splatting in plain torch: every pixel against every Gaussian.

It says what the other backends mean; for tests on tiny scenes.
Sources: EWA projection as in 3DGS (Kerbl et al. 2023), with the limits of gsplat 1.5.3.
"""

from typing import Any, cast

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from dreamdrive.scene.camera import NEAR_M
from dreamdrive.scene.harmonics import sh_basis
from dreamdrive.scene.render import Render
from dreamdrive.splat.arguments import SplatArguments, check_device, check_dtype, check_pose, check_values

FAR_M = 1e10
BLUR_PX2 = 0.3
MAX_ALPHA = 0.999
MIN_ALPHA = 1 / 255
MIN_TRANSMITTANCE = 1e-4


def rotation_matrices(quaternions: Float[Tensor, "n 4"]) -> Float[Tensor, "n 3 3"]:
    """Rotation matrices of quaternions wxyz of any length."""
    w, x, y, z = torch.nn.functional.normalize(quaternions, dim=-1, eps=1e-12).unbind(-1)
    rows = [
        torch.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
        torch.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
        torch.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
    ]
    return torch.stack(rows, -2)


def project(
    arguments: SplatArguments,
) -> tuple[
    Int[Tensor, " m"], Float[Tensor, "m 2"], Float[Tensor, "m 3"], Float[Tensor, " m"], Float[Tensor, " m"]
]:
    """Project the Gaussians beyond the near plane, nearest first; equal depths keep their order.

    Returns:
        Their index, centre in pixels, conic (xx, xy, yy of the inverse covariance in 1/px^2), opacity and
        depth in m.
    """
    rotation, translation = arguments.camera_from_world[:3, :3], arguments.camera_from_world[:3, 3]
    camera = arguments.means @ rotation.T + translation
    index = torch.nonzero((camera[:, 2] >= NEAR_M) & (camera[:, 2] <= FAR_M)).squeeze(-1)
    index = index[torch.argsort(camera[index, 2].detach(), stable=True)]
    opacity = arguments.opacities[index]
    x, y, z = camera[index].unbind(-1)
    (fx, fy), (cx, cy), (width, height) = arguments.focal_px, arguments.centre_px, arguments.size_px
    tx = (x / z).clamp(-(cx + 0.15 * width) / fx, (width - cx + 0.15 * width) / fx)
    ty = (y / z).clamp(-(cy + 0.15 * height) / fy, (height - cy + 0.15 * height) / fy)
    zero = torch.zeros_like(z)
    jacobian = torch.stack([fx / z, zero, -fx * tx / z, zero, fy / z, -fy * ty / z], -1).reshape(-1, 2, 3)
    axes = rotation_matrices(arguments.quaternions[index]) * arguments.scales[index, None, :]
    factor = jacobian @ rotation @ axes
    blur = BLUR_PX2 * torch.eye(2, dtype=factor.dtype, device=factor.device)
    covariance = factor @ factor.transpose(-1, -2) + blur
    if arguments.antialiased:
        bare = torch.linalg.det(factor @ factor.transpose(-1, -2)).clamp(min=1e-30)
        opacity = opacity * torch.sqrt(bare / torch.linalg.det(covariance))
    inverse = torch.linalg.inv(covariance)
    conic = torch.stack([inverse[:, 0, 0], inverse[:, 0, 1], inverse[:, 1, 1]], -1)
    centre = torch.stack([fx * x / z + cx, fy * y / z + cy], -1)
    if arguments.screen_offsets_px is not None:
        centre = centre + arguments.screen_offsets_px[index]
    return index, centre, conic, opacity, z


def colours(arguments: SplatArguments, index: Int[Tensor, " m"]) -> Float[Tensor, "m 3"]:
    """Colour (M, 3) of the Gaussians at ``index`` as seen from the camera: SH + 0.5, floored at 0."""
    rotation, translation = arguments.camera_from_world[:3, :3], arguments.camera_from_world[:3, 3]
    directions = torch.nn.functional.normalize(arguments.means[index] + rotation.T @ translation, dim=-1)
    basis = sh_basis(directions, arguments.sh_degree)
    return (torch.einsum("nk,nkc->nc", basis, arguments.sh[index, : basis.shape[1]]) + 0.5).clamp(min=0)


class _Absolute(torch.autograd.Function):
    """Zeros (P, M) for numbers (M,) whose gradient is the sum over P of the absolute gradients."""

    @staticmethod
    def forward(ctx: Any, numbers: Tensor, count: int) -> Tensor:
        return numbers.new_zeros(count, len(numbers))

    @staticmethod
    def backward(ctx: Any, *upstream: Tensor) -> tuple[Tensor, None]:  # pyright: ignore[reportIncompatibleMethodOverride]
        return upstream[0].abs().sum(0), None


def offsets_from(
    centre: Float[Tensor, "m 2"], absolute: Float[Tensor, "m 2"] | None, size_px: tuple[int, int]
) -> tuple[Float[Tensor, "p m"], Float[Tensor, "p m"]]:
    """From each centre to each pixel centre (rows first), along x and along y."""
    width, height = size_px
    y, x = (torch.arange(n, dtype=centre.dtype, device=centre.device) + 0.5 for n in (height, width))
    grid_y, grid_x = torch.meshgrid(y, x, indexing="ij")
    dx, dy = grid_x.reshape(-1, 1) - centre[:, 0], grid_y.reshape(-1, 1) - centre[:, 1]
    if absolute is None:
        return dx, dy
    zeros = (cast(Tensor, _Absolute.apply(absolute[:, k], len(dx))) for k in (0, 1))
    return dx - next(zeros), dy - next(zeros)


def compositing_weights(
    dx: Float[Tensor, "p m"],
    dy: Float[Tensor, "p m"],
    conic: Float[Tensor, "m 3"],
    opacities: Float[Tensor, " m"],
) -> tuple[Float[Tensor, "p m"], Bool[Tensor, " m"]]:
    """Share of each Gaussian, given front to back, in each pixel, and which reach any pixel."""
    sigma = 0.5 * (conic[:, 0] * dx * dx + conic[:, 2] * dy * dy) + conic[:, 1] * dx * dy
    alpha = (opacities * torch.exp(-sigma)).clamp(max=MAX_ALPHA)
    alpha = torch.where(alpha >= MIN_ALPHA, alpha, 0.0)
    after = torch.cumprod(1 - alpha, dim=1)
    before = torch.cat([torch.ones_like(after[:, :1]), after[:, :-1]], dim=1)
    # The transmittance only falls: from the first Gaussian that would take it too low on, nothing is added.
    weights = torch.where(after > MIN_TRANSMITTANCE, before * alpha, 0.0)
    return weights, (alpha > 0).any(0)


def rasterize_reference(arguments: SplatArguments) -> Render:
    """Splat CPU tensors of any one floating type; memory grows with pixels x Gaussians."""
    tensors = arguments.tensors()
    check_device(tensors, "cpu")
    check_dtype(tensors, (arguments.means.dtype,))
    check_pose(arguments.camera_from_world)
    check_values(arguments)
    index, centre, conic, opacity, depth = project(arguments)
    width, height = arguments.size_px
    absolute = None if arguments.screen_absolute_px is None else arguments.screen_absolute_px[index]
    dx, dy = offsets_from(centre, absolute, arguments.size_px)
    weights, reaching = compositing_weights(dx, dy, conic, opacity)
    colour = (weights @ colours(arguments, index)).reshape(height, width, 3)
    channels = arguments.channels
    if channels is None:
        channels = arguments.means.new_zeros(len(arguments.means), 0)
    visible = torch.zeros(len(arguments.means), dtype=torch.bool, device=index.device)
    visible[index[reaching]] = True
    inspected: dict[str, Tensor] = {}
    if arguments.inspect:
        inspected = _inspected(weights.detach(), depth.detach(), index, len(arguments.means))
        inspected["median_depth_m"] = inspected["median_depth_m"].reshape(height, width)
    return Render(
        colour=colour,
        alpha=weights.sum(1).reshape(height, width),
        depth_m=(weights @ depth).reshape(height, width),
        channels=(weights @ channels[index]).reshape(height, width, -1),
        visible=visible,
        **inspected,
    )


def _inspected(
    weights: Float[Tensor, "p m"], depth: Float[Tensor, " m"], index: Int[Tensor, " m"], count: int
) -> dict[str, Tensor]:
    """Median depth (P,), and the sum and largest of the weights of all ``count`` Gaussians."""
    half = weights.cumsum(1) >= 0.5
    first = torch.where(half & (half.cumsum(1) == 1), depth, 0.0).sum(1)
    total, most = weights.new_zeros(count), weights.new_zeros(count)
    total[index] = weights.sum(0)
    if len(weights):
        most[index] = weights.amax(0)
    return {"median_depth_m": first, "weight_sum_px": total, "weight_most": most}
