"""Memory of a fit on a GPU without one: gsplat that only takes what its kernels take, and a count of it all.

What is taken is what gsplat 1.5.3's sources allocate (``Projection.cpp``, ``Intersect.cpp``,
``Rasterization.cpp``, ``SphericalHarmonics.cpp``); the numbers in it are all alike.
"""

import types
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

import pytest
import torch
from torch import Tensor

from dreamdrive.compute import device
from dreamdrive.fit import activation, adam, exposure, losses
from dreamdrive.motion import deformation
from dreamdrive.splat import BACKENDS, cuda
from dreamdrive.splat.cuda import rasterize_gsplat
from tests.living import Living


class _Projected(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, means, quats, scales, viewmats, rows) -> Any:
        ctx.save_for_backward(means, quats, scales, viewmats)
        count = (1, len(means)) if rows is None else (len(rows),)
        radii = torch.ones(*count, 2, dtype=torch.int32)
        found = torch.ones(*count, 2), torch.ones(*count), torch.ones(*count, 3)
        ctx.mark_non_differentiable(radii)
        return radii, *found

    @staticmethod
    def backward(ctx: Any, *upstream: Tensor) -> Any:
        _ = [each.contiguous() for each in upstream[1:]]
        return *(torch.zeros_like(each) for each in ctx.saved_tensors), None


class _Harmonics(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, dirs, coeffs) -> Tensor:
        ctx.save_for_backward(dirs, coeffs)
        return torch.zeros(len(dirs), 3)

    @staticmethod
    def backward(ctx: Any, upstream: Tensor) -> Any:
        _ = upstream.contiguous()
        return tuple(torch.zeros_like(each) for each in ctx.saved_tensors)


class _Composited(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, means2d, conics, colors, opacities, width, height, order) -> Any:
        last = torch.zeros(1, height, width, dtype=torch.int32)
        alphas = torch.zeros(1, height, width, 1)
        ctx.save_for_backward(means2d, conics, colors, opacities, order, alphas, last)
        return torch.zeros(1, height, width, colors.shape[-1]), alphas

    @staticmethod
    def backward(ctx: Any, *upstream: Tensor) -> Any:
        _ = [each.contiguous() for each in upstream]
        return *(torch.zeros_like(each) for each in ctx.saved_tensors[:4]), None, None, None


def gsplat_taking(tiles: int, share: float = 1.0) -> types.ModuleType:
    """gsplat whose Gaussians reach ``tiles`` tiles each, and of which packed a ``share`` is in view."""

    def fully_fused_projection(
        means, covars, quats, scales, viewmats, Ks, width, height, packed, **others
    ) -> Any:
        rows = torch.arange(int(share * len(means))) if packed else None
        radii, *found = _Projected.apply(means, quats, scales, viewmats, rows)
        ids = () if rows is None else (torch.zeros_like(rows), torch.zeros_like(rows), rows)
        return *ids, radii, *found, None

    def isect_tiles(means2d, radii, depths, size, columns, lines, **ids) -> Any:
        each = torch.full_like(depths, tiles, dtype=torch.int32)
        ends = each.view(-1).cumsum(0)
        count = tiles * ends.numel()
        keys, order = torch.empty(count, dtype=torch.int64), torch.empty(count, dtype=torch.int32)
        return each, torch.empty_like(keys), torch.zeros_like(order)

    def isect_offset_encode(keys, images, columns, lines) -> Tensor:
        return torch.zeros(images, lines, columns, dtype=torch.int32)

    def rasterize_to_pixels(
        means2d, conics, colors, opacities, width, height, size, starts, order, packed=False
    ) -> Any:
        return _Composited.apply(means2d, conics, colors, opacities, width, height, order)

    module = types.ModuleType("gsplat")
    module.fully_fused_projection = fully_fused_projection
    module.isect_tiles = isect_tiles
    module.isect_offset_encode = isect_offset_encode
    module.rasterize_to_pixels = rasterize_to_pixels
    module.spherical_harmonics = lambda degree, dirs, coeffs, masks: _Harmonics.apply(dirs, coeffs)
    return module


@contextmanager
def as_on_a_gpu(patch: pytest.MonkeyPatch, tiles: int, share: float = 1.0) -> Generator[Living, None, None]:
    """Inside, fits take the path of a GPU on the CPU; tells how much lives there."""
    for module in (activation, adam, exposure, losses, deformation, device):
        patch.setattr(module, "in_core", lambda value: False)
    patch.setattr(cuda, "load_gsplat", lambda: gsplat_taking(tiles, share))
    patch.setattr(cuda, "check_device", lambda tensors, kind: None)
    patch.setitem(BACKENDS, "native", rasterize_gsplat)
    with Living() as living:
        yield living
