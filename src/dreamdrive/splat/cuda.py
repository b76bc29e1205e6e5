"""The CUDA backend: gsplat's kernels behind ``rasterize``.

Neither gsplat nor CUDA is imported before the backend is asked for.
"""

import importlib
import importlib.util
import shutil
from dataclasses import replace
from functools import cache, lru_cache, partial
from types import ModuleType
from typing import Any

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from dreamdrive.compute.compiled import Gradients, Wanted, differentiable
from dreamdrive.compute.device import why_no_cuda
from dreamdrive.errors import InputError, installing
from dreamdrive.scene.camera import NEAR_M
from dreamdrive.scene.render import Render
from dreamdrive.splat.arguments import SplatArguments, check_device, check_dtype
from dreamdrive.splat.reference import BLUR_PX2, FAR_M

TILE_PX = 16
# A kernel holds all channels of a pixel in registers; gsplat's own rendering takes as many at a time.
CHANNELS_AT_ONCE = 32
PACKED_ABOVE = 2_000_000
"""Gaussians up to which rows are kept for those out of view, too: the sizes that were timed so.

More belong to the drives of a rig, of which a camera sees a small share: the others then take neither work
nor the hundred bytes of a row; one more count is waited for.
"""


def why_unusable() -> str | None:
    """What keeps the backend from running here, and what to do about it; None where nothing does.

    Nothing is compiled: that the kernels cannot be built shows at first use. A wheel with kernels in it, as
    the project of gsplat builds for some versions of torch and CUDA, needs no compiler.
    """
    if (trouble := why_no_cuda()) is not None:
        return trouble
    if importlib.util.find_spec("gsplat") is None:
        return f"gsplat is not installed: {installing('gpu')}"
    if importlib.util.find_spec("gsplat.csrc") is None and not _has_compiler():
        return (
            "gsplat is installed without compiled kernels and there is no nvcc to compile them: "
            f"install the CUDA toolkit {torch.version.cuda}, or set CUDA_HOME to it, or install a wheel of "
            f"gsplat with kernels for torch {torch.__version__}, if its project has one"
        )
    return None


def _has_compiler() -> bool:
    from torch.utils.cpp_extension import CUDA_HOME

    return CUDA_HOME is not None and shutil.which("nvcc", path=f"{CUDA_HOME}/bin") is not None


@cache
def load_gsplat() -> ModuleType:
    """The package gsplat with its kernels, which the first call on a machine compiles for some minutes.

    Raises:
        InputError: Something is missing, or the kernels do not compile.
    """
    trouble = why_unusable()
    if trouble is not None:
        raise InputError(f"backend 'gsplat': {trouble}")
    try:
        importlib.import_module("gsplat.cuda._backend")
        return importlib.import_module("gsplat")
    except (ImportError, OSError, RuntimeError) as error:
        first_line = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(
            f"backend 'gsplat': its kernels cannot be compiled ({first_line}): check that nvcc is of CUDA "
            f"{torch.version.cuda}, with which torch is built, and that a C++ compiler it supports is there"
        ) from error


@lru_cache(maxsize=64)
def _intrinsics(
    focal_px: tuple[float, float], centre_px: tuple[float, float], device: torch.device
) -> Float[Tensor, "1 3 3"]:
    """The pinhole as a matrix on the device; kept, since each copy to the device waits for it."""
    (fx, fy), (cx, cy) = focal_px, centre_px
    # A tensor made in inference mode could not be used for training later.
    with torch.inference_mode(False):
        return torch.tensor([[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]], dtype=torch.float32, device=device)


def _colours(
    gsplat: ModuleType, arguments: SplatArguments, inside: Bool[Tensor, " n"]
) -> Float[Tensor, "n 3"]:
    """SH + 0.5, floored at 0; rows outside ``inside`` hold anything."""
    rotation, translation = arguments.camera_from_world[:3, :3], arguments.camera_from_world[:3, 3]
    # With the centre -R^T t, not that of an inverted matrix, the gradient takes the pose's entries as free.
    directions = arguments.means + (rotation * translation[:, None]).sum(0)
    harmonics = gsplat.spherical_harmonics(arguments.sh_degree, directions, arguments.sh, masks=inside)
    return (harmonics + 0.5).clamp(min=0)


def _project(gsplat: ModuleType, arguments: SplatArguments, packed: bool) -> tuple[Any, ...]:
    """Radii, centres, depths, conics, dilutions or None; packed, batch, camera and row of each before."""
    (width, height), means = arguments.size_px, arguments.means
    intrinsics = _intrinsics(arguments.focal_px, arguments.centre_px, means.device)
    return gsplat.fully_fused_projection(
        means, None, arguments.quaternions, arguments.scales, arguments.camera_from_world[None], intrinsics,
        width, height, eps2d=BLUR_PX2, near_plane=NEAR_M, far_plane=FAR_M, packed=packed,
        opacities=arguments.opacities, calc_compensations=arguments.antialiased,
    )  # fmt: skip


def _in_view(arguments: SplatArguments, rows: Int[Tensor, " m"]) -> SplatArguments:
    """Those of the Gaussians at these rows, each of which is there once."""
    each = {name: value for name, value in arguments.tensors().items() if name != "camera_from_world"}
    picked = {name: differentiable(partial(_picked, rows), value) for name, value in each.items()}
    return replace(arguments, **picked)


def _picked(rows: Tensor, value: Tensor, *, wanted: Wanted) -> tuple[Tensor, Gradients]:
    def gradients(upstream: Tensor) -> tuple[Tensor]:
        # That of index_select adds, and takes the memory of all rows twice.
        return (torch.zeros_like(value).index_copy_(0, rows, upstream),)

    return value.index_select(0, rows), gradients


def _splat(gsplat: ModuleType, arguments: SplatArguments) -> Render:
    """Project, list by tile, composite. Rows of culled Gaussians have radius 0 and are not written.

    Of more than ``PACKED_ABOVE`` Gaussians there are only the rows in view, and what follows is of those.
    """
    width, height = arguments.size_px
    count, packed = len(arguments.means), len(arguments.means) > PACKED_ABOVE
    projected = _project(gsplat, arguments, packed)
    rows, ids = None, dict[str, Any]()
    if packed:
        _, cameras, rows = projected[:3]  # all of one camera
        arguments = _in_view(arguments, rows)
        ids = {"packed": True, "n_images": 1, "image_ids": cameras, "gaussian_ids": rows}
    radii, centres, depths, conics, dilutions = projected[-5:]
    opacities = arguments.opacities.view(depths.shape)
    inside = (radii > 0).all(-1)
    if arguments.antialiased:
        opacities = opacities * torch.where(inside, dilutions, 0.0)
    if arguments.screen_offsets_px is not None:
        centres = centres + arguments.screen_offsets_px
    columns, lines = -(-width // TILE_PX), -(-height // TILE_PX)
    tiles, keys, order = gsplat.isect_tiles(centres, radii, depths, TILE_PX, columns, lines, **ids)
    starts = gsplat.isect_offset_encode(keys, 1, columns, lines)

    values = [_colours(gsplat, arguments, inside.view(-1)), depths.view(-1, 1)]
    if arguments.channels is not None:
        values.append(arguments.channels)
    of_each = torch.cat(values, dim=-1) if packed else torch.cat(values, dim=-1)[None]
    composited = [
        gsplat.rasterize_to_pixels(
            centres, conics, some, opacities, width, height, TILE_PX, starts, order, packed=packed
        )
        for some in of_each.split(CHANNELS_AT_ONCE, dim=-1)
    ]
    image = torch.cat([image[0] for image, _ in composited], dim=-1)
    colour, depth, channels = image.split([3, 1, image.shape[-1] - 4], dim=-1)
    _, alpha = composited[0]
    visible = tiles.view(-1) > 0
    return Render(
        colour=colour,
        alpha=alpha[0, ..., 0],
        depth_m=depth[..., 0],
        channels=channels,
        visible=visible if rows is None else visible.new_zeros(count).index_copy(0, rows, visible),
    )


def _empty(arguments: SplatArguments) -> Render:
    """What no Gaussian at all looks like, differentiable in the empty tensors as with the other backends."""
    width, height = arguments.size_px
    nothing = torch.stack([t.sum() for t in arguments.tensors().values() if t.numel() == 0]).sum()
    channels = 0 if arguments.channels is None else arguments.channels.shape[1]
    return Render(
        colour=nothing.expand(height, width, 3),
        alpha=nothing.expand(height, width),
        depth_m=nothing.expand(height, width),
        channels=nothing.expand(height, width, channels),
        visible=torch.zeros(0, dtype=torch.bool, device=nothing.device),
    )


def rasterize_gsplat(arguments: SplatArguments) -> Render:
    """Splat float32 tensors of one CUDA device with the kernels of gsplat 1.5.3.

    Values and gradients are those of the other backends up to rounding; that of ``screen_offsets_px`` is what
    gsplat gives its projected centres, in pixels. What differs:

    - NaN and infinite numbers are not looked for, since that would wait for the device; a quaternion of
      length zero gives NaN.
    - ``visible`` says that the box around the footprint, not the footprint itself, reaches a tile.
    - A Gaussian whose footprint is outside the image before its screen offset is added stays out.
    - The kernels approximate exp, so that a footprint may end a pixel earlier or later, and recover the
      transmittance by division on the way back: gradients from almost opaque pixels keep three digits, as
      do those of Gaussians 60 times longer than wide.
    - Gradients are summed in no fixed order: their last bits change from run to run.

    Raises:
        InputError: The backend cannot be used here; the message says what to do.
        ValueError: A tensor is not float32 or not on a CUDA device.
    """
    if arguments.inspect or arguments.screen_absolute_px is not None:
        raise ValueError("inspect, screen_absolute_px: the backend 'gsplat' has neither, 'native' has both")
    gsplat = load_gsplat()
    tensors = arguments.tensors()
    check_device(tensors, "cuda")
    check_dtype(tensors, (torch.float32,))
    if len(arguments.means) == 0:  # gsplat would divide by their number, which ends the process
        return _empty(arguments)
    return _splat(gsplat, arguments)
