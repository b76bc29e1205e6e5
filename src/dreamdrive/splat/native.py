"""The compiled CPU backend as a differentiable torch function."""

from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from dreamdrive import _native
from dreamdrive.scene.render import Render
from dreamdrive.splat.arguments import SplatArguments, check_device, check_dtype, check_pose, check_values

# Position of each differentiable argument of _Rasterize.
_NAMES = (
    "means",
    "quaternions",
    "scales",
    "opacities",
    "sh",
    "channels",
    "screen_offsets_px",
    "screen_absolute_px",
    "camera_from_world",
)


def _buffer(tensor: Any) -> Any:
    return None if tensor is None else tensor.detach().contiguous()


class _Rasterize(torch.autograd.Function):
    """From the tensors of ``_NAMES`` and the arguments to colour, alpha, depth, channels and visible.

    If wanted, then also median depth and the sum and largest of the weights.
    """

    @staticmethod
    def forward(ctx: Any, *inputs: Any) -> tuple[Tensor, ...]:
        *tensors, arguments = inputs
        means, quaternions, scales, opacities, sh, extra, offsets, _, camera_from_world = map(
            _buffer, tensors
        )
        gaussians = _native.gaussians(
            means, quaternions, scales, opacities, sh, extra, offsets, arguments.sh_degree
        )
        if not _native.all_usable(gaussians):
            check_values(arguments)
        width, height = arguments.size_px
        colour, alpha, depth = (torch.empty(height, width, *tail) for tail in ((3,), (), ()))
        channels = torch.empty(height, width, 0 if extra is None else extra.shape[1])
        visible = torch.empty(len(means), dtype=torch.bool)
        learning = any(ctx.needs_input_grad)
        (fx, fy), (cx, cy) = arguments.focal_px, arguments.centre_px
        frame = _native.forward(
            gaussians, camera_from_world, fx, fy, cx, cy, width, height, arguments.antialiased,
            colour, alpha, depth, channels, visible, learning or arguments.inspect,
        )  # fmt: skip
        fixed = [visible]
        if arguments.inspect and frame is not None:
            fixed += [torch.empty(height, width), torch.empty(len(means)), torch.empty(len(means))]
            _native.inspect(gaussians, frame, *fixed[1:])
        if learning:
            ctx.gaussians, ctx.frame = gaussians, frame
            ctx.save_for_backward(*tensors)  # so that torch notices what was changed in place before backward
        ctx.mark_non_differentiable(*fixed)
        ctx.set_materialize_grads(False)
        return colour, alpha, depth, channels, *fixed

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *upstream: Tensor | None) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        colour, alpha, depth, channels = (_buffer(g) for g in upstream[:4])
        tensors: tuple[Tensor | None, ...] = ctx.saved_tensors
        if colour is alpha is depth is channels is None:
            return (None,) * (len(_NAMES) + 1)
        gradients = [
            torch.empty(t.shape) if t is not None and needs else None
            for t, needs in zip(tensors, ctx.needs_input_grad[:-1], strict=True)
        ]
        means, quaternions, scales, opacities, sh, extra, offsets, absolute, _ = gradients
        pose = torch.empty(4, 4)
        _native.backward(
            ctx.gaussians, ctx.frame, colour, alpha, depth, channels,
            means, quaternions, scales, opacities, sh, extra, offsets, absolute, pose,
        )  # fmt: skip
        return (*gradients[:-1], pose if ctx.needs_input_grad[8] else None, None)


def rasterize_native(arguments: SplatArguments) -> Render:
    """Splat float32 CPU tensors with the compiled core.

    Values and gradients do not depend on the number of threads. Gradients of Gaussians that reach no tile are
    exactly zero. A NaN that comes from upstream for a pixel reaches the gradients of the Gaussians there and
    of the pose, but of no Gaussian that ends more than a tile (16 px) away.

    Raises:
        ValueError: A tensor is not float32 or holds numbers of no use; the pose is not rigid.
    """
    tensors = arguments.tensors()
    check_device(tensors, "cpu")
    check_dtype(tensors, (torch.float32,))
    check_pose(arguments.camera_from_world)
    ordered = [getattr(arguments, name) for name in _NAMES]
    return Render(*_Rasterize.apply(*ordered, arguments))  # pyright: ignore[reportGeneralTypeIssues]
