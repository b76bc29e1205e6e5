"""Differentiable splatting of Gaussians with activated parameters."""

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.scene.render import Render
from dreamdrive.splat.arguments import SplatArguments, active_degree, check_pinhole, check_shapes
from dreamdrive.splat.cuda import rasterize_gsplat
from dreamdrive.splat.native import rasterize_native
from dreamdrive.splat.reference import rasterize_reference

BACKENDS: dict[str, Callable[[SplatArguments], Render]] = {
    "native": rasterize_native,
    "reference": rasterize_reference,
    "gsplat": rasterize_gsplat,
}


def rasterize(
    means: Float[Tensor, "..."],
    quaternions: Float[Tensor, "..."],
    scales: Float[Tensor, "..."],
    opacities: Float[Tensor, "..."],
    sh: Float[Tensor, "..."],
    camera_from_world: Float[Tensor, "..."],
    *,
    fx_px: float,
    fy_px: float,
    cx_px: float,
    cy_px: float,
    width_px: int,
    height_px: int,
    channels: Float[Tensor, "..."] | None = None,
    screen_offsets_px: Float[Tensor, "..."] | None = None,
    screen_absolute_px: Float[Tensor, "..."] | None = None,
    sh_degree: int | None = None,
    antialiased: bool = False,
    inspect: bool = False,
    backend: str | None = None,
) -> Render:
    """Splat Gaussians as a pinhole sees them; differentiable in every tensor given.

    EWA projection and front-to-back compositing with the limits of gsplat 1.5.3: near plane 0.2 m, 0.3 px^2
    added to the projected covariance, alpha = min(0.999, opacity exp(-sigma)) skipped below 1/255, the
    Gaussian that would take the transmittance to 1e-4 or less is not added; order by camera depth, equal
    depths keep index order.

    Args:
        means: Centres (N, 3) in metres, world frame.
        quaternions: Rotations (N, 4), wxyz, normalised inside.
        scales: Standard deviations (N, 3) in metres.
        opacities: In [0, 1] (N,).
        sh: Spherical-harmonic colour (N, K, 3), K = 1, 4, 9 or 16; colour = SH(direction) + 0.5, at least 0.
        camera_from_world: Rigid transform (4, 4), or several (B, 4, 4): then every image has B views of one
            pinhole, and gradients are summed over them. Its gradient covers all 12 entries of the upper 3x4,
            taken as free; the camera centre is -R^T t.
        fx_px: Focal length along x in pixels.
        fy_px: Focal length along y in pixels.
        cx_px: Principal point from the left edge in pixels.
        cy_px: Principal point from the top edge in pixels.
        width_px: Image width.
        height_px: Image height.
        channels: Further values per Gaussian (N, C), composited like colour.
        screen_offsets_px: Added to the projected centres (N, 2): zeros whose gradient densification reads.
        screen_absolute_px: Any numbers (N, 2), which change nothing: their gradient is the sum over the
            pixels of ``|dL/du|`` and ``|dL/dv|``, which do not cancel where a Gaussian is too large (AbsGS).
        sh_degree: Degree to evaluate, at most the stored one (default); higher ones get zero gradients.
        antialiased: Multiply each opacity by sqrt(det / det') of the projected covariance before and after
            the 0.3 px^2 are added, so that small Gaussians do not gain weight from afar (Mip-Splatting).
        inspect: Fill ``median_depth_m``, ``weight_sum_px`` and ``weight_most`` of the result.
        backend: "native" (compiled, float32, on the CPU), "gsplat" (float32, on a CUDA device, see
            ``splat.cuda`` for where it differs) or "reference" (plain torch, tiny scenes). Without it the
            device of the means decides between the first two.

    Raises:
        ValueError: An argument has the wrong shape, type or device, or holds NaN; the message names it.
    """
    backend = backend or ("native" if means.is_cpu else "gsplat")
    if backend not in BACKENDS:
        raise ValueError(f"backend: expected one of {', '.join(sorted(BACKENDS))}, got {backend!r}")
    tensors: dict[str, Any] = {
        "means": means,
        "quaternions": quaternions,
        "scales": scales,
        "opacities": opacities,
        "sh": sh,
        "camera_from_world": camera_from_world,
        "channels": channels,
        "screen_offsets_px": screen_offsets_px,
        "screen_absolute_px": screen_absolute_px,
    }
    check_shapes(tensors)
    focal, centre = (float(fx_px), float(fy_px)), (float(cx_px), float(cy_px))
    size = int(width_px), int(height_px)
    check_pinhole(focal, centre, size)
    degree = active_degree(sh_degree, sh.shape[1])
    views: list[Render] = []
    for pose in camera_from_world[None] if camera_from_world.ndim == 2 else camera_from_world:
        tensors["camera_from_world"] = pose
        arguments = SplatArguments(
            **tensors,
            focal_px=focal,
            centre_px=centre,
            size_px=size,
            sh_degree=degree,
            antialiased=antialiased,
            inspect=inspect,
        )
        views.append(BACKENDS[backend](arguments))
    return views[0] if camera_from_world.ndim == 2 else _stacked(views)


def _stacked(views: list[Render]) -> Render:
    """Views of the same Gaussians as one, batch first."""
    stacked: dict[str, Any] = {}
    for field in fields(Render):
        parts = [getattr(view, field.name) for view in views]
        stacked[field.name] = None if parts[0] is None else torch.stack(parts)
    return Render(**stacked)
