"""Types of the compiled core (native/module.cpp).

Arrays are contiguous float32 CPU tensors, ``visible`` is bool.
"""

from torch import Tensor

class Frame:
    """What one forward pass leaves for its backward pass."""

class Gaussians:
    """The Gaussians of one call, by reference."""

def gaussians(
    means: Tensor,
    quaternions: Tensor,
    scales: Tensor,
    opacities: Tensor,
    sh: Tensor,
    channels: Tensor | None,
    offsets: Tensor | None,
    sh_degree: int,
) -> Gaussians: ...
def forward(
    gaussians: Gaussians,
    camera_from_world: Tensor,
    fx: float,
    fy: float,
    cx: float,
    cy: float,
    width: int,
    height: int,
    antialiased: bool,
    colour: Tensor,
    alpha: Tensor,
    depth: Tensor,
    channels: Tensor,
    visible: Tensor,
    keep: bool,
) -> Frame | None: ...
def backward(
    gaussians: Gaussians,
    frame: Frame,
    colour: Tensor | None,
    alpha: Tensor | None,
    depth: Tensor | None,
    channels: Tensor | None,
    d_means: Tensor | None,
    d_quaternions: Tensor | None,
    d_scales: Tensor | None,
    d_opacities: Tensor | None,
    d_sh: Tensor | None,
    d_channels: Tensor | None,
    d_screen: Tensor | None,
    d_screen_absolute: Tensor | None,
    d_pose: Tensor,
) -> None: ...
def inspect(
    gaussians: Gaussians, frame: Frame, median_depth: Tensor, weight_sum: Tensor, weight_most: Tensor
) -> None: ...
def ssim_forward(image: Tensor, target: Tensor, map: Tensor, partials: Tensor | None) -> None: ...
def ssim_backward(
    image: Tensor, target: Tensor, partials: Tensor, d_map: Tensor, d_image: Tensor
) -> None: ...
def stage_seconds() -> dict[str, float]: ...
def all_usable(gaussians: Gaussians) -> bool: ...
def set_threads(count: int) -> None: ...
def threads() -> int: ...
def isa() -> str: ...
