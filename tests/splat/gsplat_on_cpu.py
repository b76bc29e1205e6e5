"""gsplat's own plain-torch functions in the place of its CUDA kernels, called exactly as the kernels are."""

import inspect
import sys
import types
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import gsplat
import pytest
import torch
from gsplat.cuda import _torch_impl
from torch import Tensor


def nerfacc_stand_in() -> types.ModuleType:
    """The two functions gsplat's compositing takes from nerfacc, for pairs sorted by ray."""

    def render_weight_from_alpha(alphas: Tensor, ray_indices: Tensor, n_rays: int) -> tuple[Tensor, Tensor]:
        logs = torch.log1p(-alphas.double())
        before = torch.cumsum(logs, 0) - logs
        first = torch.searchsorted(ray_indices, torch.arange(n_rays)).clamp(max=len(alphas) - 1)
        through = torch.exp(before - before[first][ray_indices]).to(alphas.dtype)
        return through * alphas, through

    def accumulate_along_rays(
        weights: Tensor, values: Tensor | None, ray_indices: Tensor, n_rays: int
    ) -> Tensor:
        source = weights[:, None] if values is None else weights[:, None] * values
        return source.new_zeros(n_rays, source.shape[1]).index_add(0, ray_indices, source)

    module = types.ModuleType("nerfacc")
    module.render_weight_from_alpha = render_weight_from_alpha
    module.accumulate_along_rays = accumulate_along_rays
    return module


def pairs_of_tiles(
    range_start, range_end, transmittances, means2d, conics, opacities,
    image_width, image_height, tile_size, isect_offsets, flatten_ids,
) -> tuple[Tensor, Tensor, Tensor]:  # fmt: skip
    """Stand-in for gsplat's CUDA kernel: the composited (Gaussian, pixel) pairs of one image, by pixel."""
    assert range_start == 0
    assert (transmittances == 1).all()
    starts = [*isect_offsets.flatten().tolist(), len(flatten_ids)]
    gaussians, pixels = [], []
    for tile, (start, stop) in enumerate(pairwise(starts)):
        listed = flatten_ids[start:stop].long()
        row, column = divmod(tile, isect_offsets.shape[-1])
        y = torch.arange(row * tile_size, min((row + 1) * tile_size, image_height))
        x = torch.arange(column * tile_size, min((column + 1) * tile_size, image_width))
        y, x = (axis.reshape(-1, 1) for axis in torch.meshgrid(y, x, indexing="ij"))
        dx, dy = x + 0.5 - means2d[0, listed, 0], y + 0.5 - means2d[0, listed, 1]
        a, b, c = conics[0, listed].unbind(-1)
        alpha = opacities[0, listed] * torch.exp(-(0.5 * (a * dx**2 + c * dy**2) + b * dx * dy))
        alpha = torch.where(alpha >= 1 / 255, alpha.clamp(max=0.999), 0.0)
        pixel, place = torch.nonzero((alpha > 0) & (torch.cumprod(1 - alpha, 1) > 1e-4), as_tuple=True)
        gaussians.append(listed[place])
        pixels.append((y * image_width + x)[pixel, 0])
    gaussians, pixels = torch.cat(gaussians), torch.cat(pixels)
    order = torch.argsort(pixels, stable=True)
    return gaussians[order], pixels[order], torch.zeros_like(pixels)


def written(inside: Tensor, values: Tensor) -> Tensor:
    """The values of what is inside; the kernels leave the other rows as the memory was."""
    return torch.where(inside, values, torch.nan)


def project(
    means, quats, scales, viewmats, Ks, opacities, packed=False, **others
) -> tuple[Tensor | None, ...]:
    covariances, _ = _torch_impl._quat_scale_to_covar_preci(quats, scales, True, False)
    radii, *numbers, dilutions = _torch_impl._fully_fused_projection(
        means, covariances, viewmats, Ks, **others
    )
    radii = torch.where(opacities[:, None] >= 1 / 255, radii, 0)
    inside = (radii > 0).all(-1)
    means2d, depths, conics = numbers
    if packed:
        rows = torch.nonzero(inside[0]).squeeze(1)
        found = (radii, means2d, depths, conics, dilutions)
        nothing = torch.zeros_like(rows)
        return (nothing, nothing, rows, *(None if each is None else each[0, rows] for each in found))
    return (
        radii,
        written(inside[..., None], means2d),
        written(inside, depths),
        written(inside[..., None], conics),
        None if dilutions is None else written(inside, dilutions),
    )


def spherical_harmonics(degrees_to_use, dirs, coeffs, masks) -> Tensor:
    return written(masks[..., None], _torch_impl._spherical_harmonics(degrees_to_use, dirs, coeffs))


def list_by_tile(
    means2d, radii, depths, tile_size, tile_width, tile_height,
    packed=False, n_images=None, image_ids=None, gaussian_ids=None,
) -> tuple[Tensor, Tensor, Tensor]:  # fmt: skip
    if not packed:
        return _torch_impl._isect_tiles(means2d, radii, depths, tile_size, tile_width, tile_height)
    assert (n_images, len(image_ids), len(gaussian_ids)) == (1, len(depths), len(depths))
    each = (value[None] for value in (means2d, radii, depths))
    tiles, *others = _torch_impl._isect_tiles(*each, tile_size, tile_width, tile_height)
    return tiles[0], *others


def composite(means2d, conics, colors, opacities, packed=False, **others) -> tuple[Tensor, Tensor]:
    given = (means2d, conics, colors, opacities)
    assert means2d.ndim == (2 if packed else 3)
    return _torch_impl._rasterize_to_pixels(*(each[None] if packed else each for each in given), **others)


def offsets(isect_ids, n_images, tile_width, tile_height) -> Tensor:
    return _torch_impl._isect_offset_encode(isect_ids, n_images, tile_width, tile_height)


STAND_INS = {
    "fully_fused_projection": project,
    "spherical_harmonics": spherical_harmonics,
    "isect_tiles": list_by_tile,
    "isect_offset_encode": offsets,
    "rasterize_to_pixels": composite,
}


def called_like(kernel: Callable[..., Any], stand_in: Callable[..., Any]) -> Callable[..., Any]:
    """``stand_in`` with the arguments that a call of ``kernel`` binds, without those left at default."""
    signature = inspect.signature(kernel)

    def call(*args: Any, **kwargs: Any) -> Any:
        bound = signature.bind(*args, **kwargs).arguments
        given = {k: v for k, v in bound.items() if v is not signature.parameters[k].default and v is not None}
        return stand_in(**given)

    return call


def gsplat_on_cpu(monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
    """What the backend uses of gsplat, able to run on the CPU."""
    monkeypatch.setitem(sys.modules, "nerfacc", nerfacc_stand_in())
    monkeypatch.setattr("gsplat.cuda._wrapper.rasterize_to_indices_in_range", pairs_of_tiles)
    module = types.ModuleType("gsplat")
    for name, stand_in in STAND_INS.items():
        setattr(module, name, called_like(getattr(gsplat, name), stand_in))
    return module
