"""Normal equations of one image: depth eliminated, cameras and pairs left."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from dreamdrive.geometry.backends.dust3r.align.rays import Distance, Penalty, RayMisses, pixel_rays
from dreamdrive.geometry.backends.dust3r.align.state import PER_EDGE, PER_IMAGE, State

_TINY = 1e-30


@dataclass(frozen=True)
class ImageSamples:
    """Some pixels of an image and what the edges that speak of it say of them, in float64.

    The index is row-major, columns and stretched rows are relative to the principal point, points in the
    frame of the edge's first camera. Log confidence over the divisor of the loss, times the pixels that each
    one stands for, is the weight.
    """

    image: int
    edges: tuple[int, ...]
    index: Int[np.ndarray, " p"]
    pixels: Float[Tensor, "p 2"]
    points: Float[Tensor, "k p 3"]
    weight: Float[Tensor, "k p"]

    def rays(self, state: State) -> Float[Tensor, "p 3"]:
        """Directions in the camera's frame, z = 1."""
        return pixel_rays(self.pixels, float(state.focal_px[self.image]))

    def misses(self, state: State) -> RayMisses:
        """Where the edges place the points, relative to the rays."""
        parts = [state.camera_from_edge(self.image, edge) for edge in self.edges]
        matrices, shifts = (torch.from_numpy(np.stack(part)) for part in zip(*parts, strict=True))
        placed = torch.baddbmm(shifts[:, None], self.points, matrices.mT)
        return RayMisses.of(self.rays(state), placed, self.weight)


def normal_equations(
    samples: ImageSamples,
    state: State,
    depth: Float[Tensor, " p"],
    penalty: Penalty,
    bend: float = 0.0,
) -> tuple[Float[Tensor, "q q"], Float[Tensor, " q"]]:
    """Hessian and gradient of one image's cost over its own 7 steps and then 7 of each of its K edges.

    Gauss-Newton with the weights of the touching quadratic, depth eliminated by its Schur complement.

    A miss is r = X - Y, X = c + R x d with the ray x, Y = T + s R P. With W the 3x3 weight of a miss,
    J = dr/d(step) and D = dX/d(depth) = R x, each pixel adds J'WJ - (D'WJ)'(D'WJ) / (D'WD). Where W tells the
    directions along and across the ray apart it turns with the ray, which the gradient knows and the Hessian
    does not. The depth is the best for this state.

    ``bend`` is the share of the true curvature of a distance along the miss itself, where it has none, that
    is taken: 0 is the quadratic that lies above everywhere, 1 would be Newton's. For :class:`Distance` alone.
    """
    edges = list(samples.edges)
    turn = torch.from_numpy(state.rotation[samples.image])
    rays = samples.rays(state)
    world_rays = rays @ turn.T
    arm = world_rays * depth[:, None]
    misses = samples.misses(state)
    _, weight = misses.cost(depth, penalty, depth)

    spins = torch.from_numpy(state.edge_scale[edges, None, None] * state.edge_rotation[edges])
    lever = torch.bmm(samples.points, spins.mT)
    offset = torch.from_numpy(state.centre[samples.image] - state.edge_centre[edges])
    miss = offset[:, None] + arm - lever
    flat = torch.cat([rays[:, :2], torch.zeros_like(rays[:, :1])], dim=1) @ turn.T
    own = _columns(arm, -1.0, -flat * depth[:, None])
    theirs = _columns(lever, 1.0, -lever)

    straight = penalty.across
    if isinstance(penalty, Distance):
        slack, bent = 0.0, -bend
        axis = miss / (miss.square().sum(dim=-1, keepdim=True) + penalty.floor**2).sqrt()
    else:
        slack = bent = 1 - penalty.across
        axis = (world_rays / misses.length[:, None]).expand_as(miss)
    weighed = _weighed(theirs, weight, straight, bent, axis)
    metric = straight * weight.sum(dim=0)[:, None, None] * torch.eye(3, dtype=torch.float64)
    if bent:
        by_pixel = axis.transpose(0, 1)
        metric = metric + by_pixel.mT @ (by_pixel * (bent * weight).T[..., None])
    pull = _weighed(miss[..., None], weight, straight, slack, axis)[..., 0]
    hessian, gradient = _assembled(own, theirs, weighed, metric, pull, world_rays)
    if slack:
        bends = -(flat - axis[0] * (axis[0] * flat).sum(dim=-1, keepdim=True)) / misses.length[:, None]
        along = weight * (axis * miss).sum(dim=-1)
        gradient[:3] -= torch.linalg.cross(miss, pull).sum(dim=(0, 1))
        gradient[6] += slack * (along * (bends * miss).sum(dim=-1)).sum()
    return hessian, gradient


def _assembled(
    own: Float[Tensor, "p 3 7"],
    theirs: Float[Tensor, "k p 3 7"],
    weighed: Float[Tensor, "k p 3 7"],
    metric: Float[Tensor, "p 3 3"],
    pull: Float[Tensor, "k p 3"],
    ray: Float[Tensor, "p 3"],
) -> tuple[Float[Tensor, "q q"], Float[Tensor, " q"]]:
    """Sums over pixels, and the Schur complement of the depths."""
    count, pixels = theirs.shape[:2]
    size = PER_IMAGE + PER_EDGE * count
    flat_own, flat_weighed = own.reshape(-1, PER_IMAGE), weighed.reshape(count, -1, PER_EDGE)
    flat_theirs = theirs.reshape(count, -1, PER_EDGE).mT
    metric_own = metric @ own
    hessian = torch.zeros(size, size, dtype=torch.float64)
    hessian[:PER_IMAGE, :PER_IMAGE] = flat_own.T @ metric_own.reshape(-1, PER_IMAGE)
    blocks, sides = flat_theirs @ flat_weighed, flat_own.T @ flat_weighed
    hessian[PER_IMAGE:, PER_IMAGE:] = torch.block_diag(*blocks)
    hessian[:PER_IMAGE, PER_IMAGE:] = sides.transpose(0, 1).reshape(PER_IMAGE, -1)
    hessian[PER_IMAGE:, :PER_IMAGE] = hessian[:PER_IMAGE, PER_IMAGE:].T
    total = pull.sum(dim=0)
    gradient = torch.cat([flat_own.T @ total.ravel(), (flat_theirs @ pull.reshape(count, -1, 1)).ravel()])

    coupling = torch.empty(pixels, size, dtype=torch.float64)
    coupling[:, :PER_IMAGE] = (ray[:, None] @ metric_own)[:, 0]
    coupling[:, PER_IMAGE:] = (ray[None, :, None] @ weighed)[:, :, 0].transpose(0, 1).reshape(pixels, -1)
    stiffness = (ray * (metric @ ray[..., None])[..., 0]).sum(dim=1)
    scaled = coupling * torch.where(stiffness > 0, 1 / stiffness.clamp_min(_TINY), 0.0)[:, None]
    hessian -= coupling.T @ scaled
    gradient -= scaled.T @ (ray * total).sum(dim=1)
    return hessian, gradient


def _columns(
    lever: Float[Tensor, "*p 3"], sign: float, last: Float[Tensor, "*p 3"]
) -> Float[Tensor, "*p 3 7"]:
    """Derivatives of a miss by a turn, sign [lever], a shift, -sign I, and one number."""
    result = lever.new_zeros(*lever.shape, PER_IMAGE)
    for row, column, part in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        result[..., row, column] = -sign * lever[..., part]
        result[..., column, row] = sign * lever[..., part]
    for axis in range(3):
        result[..., axis, 3 + axis] = -sign
    result[..., 6] = last
    return result


def _weighed(
    columns: Float[Tensor, "k p 3 c"],
    weight: Float[Tensor, "k p"],
    straight: float,
    bent: float,
    axis: Float[Tensor, "k p 3"],
) -> Float[Tensor, "k p 3 c"]:
    """W J with W = w (straight I + bent a a')."""
    result = columns * (straight * weight)[..., None, None]
    if bent:
        along = (axis[..., None] * columns).sum(dim=2, keepdim=True)
        result.addcmul_(((bent * weight)[..., None] * axis)[..., None], along)
    return result
