"""OpenSplat's CPU rasteriser from a user's checkout, compiled into a cache folder and run on our scenes.

It is run as its program runs it, but for one thing: it reads the depths as if they lay one after the other in
memory, which they do not; they are handed over so that they do, or the image would be wrong.
"""

import hashlib
import os
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from dreamdrive_bench.splat.passes import View
from dreamdrive_bench.splat.programs import cache_dir

BINDING = Path(__file__).with_name("opensplat_binding.cpp")
SOURCE = Path("rasterizer/gsplat-cpu/gsplat_cpu.cpp")


@cache
def load_opensplat(checkout: Path) -> Any:
    """The checkout's rasteriser as a module; compiled once for each state of its source."""
    source = checkout / SOURCE
    if not source.is_file():
        raise SystemExit(f"--opensplat: expected a checkout of OpenSplat with {SOURCE}, got {checkout}")
    from torch.utils import cpp_extension  # here: it looks for compilers when imported

    digest = hashlib.sha256(source.read_bytes() + BINDING.read_bytes()).hexdigest()[:12]
    build = cache_dir() / f"opensplat-{digest}-torch-{torch.__version__}"
    build.mkdir(exist_ok=True)
    os.environ["PATH"] += os.pathsep + str(Path(sys.executable).parent)  # where pip puts ninja
    return cpp_extension.load(
        name="opensplat_cpu",
        sources=[str(BINDING), str(source)],
        extra_include_paths=[str(checkout)],
        extra_cflags=["-O3", "-march=native"],
        build_directory=str(build),
    )


class _Rasterize(torch.autograd.Function):
    """From centres, conics, colours and opacities to the image."""

    @staticmethod
    def forward(ctx: Any, module: Any, size: tuple[int, int], fixed: tuple[Tensor, ...], *inputs: Tensor):
        background, covariances, depths = fixed
        centres, conics, colours, opacities = inputs
        image, transmittance, lists = module.rasterize(
            *size, centres, conics, colours, opacities, background, covariances, depths
        )
        ctx.module, ctx.size, ctx.lists = module, size, lists
        ctx.save_for_backward(*inputs, *fixed, transmittance)
        return image

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, by_image: Tensor):
        gradients = ctx.module.rasterize_backward(
            *ctx.size, *ctx.saved_tensors, ctx.lists, by_image, torch.zeros(by_image.shape[:2])
        )
        return (None, None, None, *gradients)


def projection_of(camera: dict[str, float], view: Tensor) -> Tensor:
    """Clip from world (4, 4). Clip z is -1, so that z / w orders like depth without losing digits."""
    clip = torch.zeros(4, 4)
    clip[0, 0] = 2 * camera["fx_px"] / camera["width_px"]
    clip[1, 1] = 2 * camera["fy_px"] / camera["height_px"]
    clip[0, 2] = 2 * camera["cx_px"] / camera["width_px"] - 1
    clip[1, 2] = 2 * camera["cy_px"] / camera["height_px"] - 1
    clip[2, 3] = -1
    clip[3, 2] = 1
    return clip @ view


def render(module: Any, leaves: dict[str, Tensor], camera: dict[str, Any], colours: Tensor) -> Tensor:
    """Image (h, w, 3) of the tensors our ``rasterize`` takes, with plain colours (N, 3) in place of SH."""
    view, size = leaves["camera_from_world"], (camera["width_px"], camera["height_px"])
    lens = (camera["fx_px"], camera["fy_px"], camera["cx_px"], camera["cy_px"])
    centres, _, conics, covariances, depths = module.project(
        leaves["means"], leaves["scales"], leaves["quaternions"], view, projection_of(camera, view), *lens,
        size[1], size[0],
    )  # fmt: skip
    fixed = (torch.zeros(3), covariances.detach(), depths.detach().contiguous())
    inputs = (centres, conics, colours, leaves["opacities"][:, None])
    return _Rasterize.apply(module, size, fixed, *(x.contiguous() for x in inputs))


def opensplat_passes(
    module: Any, view: View, colours: Tensor
) -> tuple[Callable[[], Tensor], Callable[[], object]]:
    """A forward pass that gives the image, and both passes with gradients to all but the pose."""
    leaves = view.leaves()
    del leaves["sh"]
    own_colours = colours.detach().requires_grad_()
    wanted = [own_colours, *(leaf for leaf in leaves.values() if leaf.requires_grad)]

    def forward() -> Tensor:
        with torch.no_grad():
            return render(module, leaves, view.camera, own_colours)

    def forward_backward() -> object:
        return torch.autograd.grad(render(module, leaves, view.camera, own_colours), wanted, view.upstream)

    return forward, forward_backward
