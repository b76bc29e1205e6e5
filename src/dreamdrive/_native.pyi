"""Types of the compiled core: native/bindings/module.cpp and what that binds from its neighbours.

Arrays are contiguous float32 CPU tensors, or NumPy's of geometry; ``visible``, ``mask``, ``usable`` and the
``sky`` of the geometry loss are bool, ``actor`` is int64, ``taps`` and ``details`` are
int32, homographies are float64.
"""

import numpy as np
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
def l1_ssim(image: Tensor, target: Tensor, mask: Tensor, partials: Tensor | None) -> tuple[float, float]: ...
def l1_ssim_backward(
    image: Tensor,
    target: Tensor,
    mask: Tensor,
    partials: Tensor,
    by_l1: float,
    by_ssim: float,
    d_image: Tensor,
) -> None: ...
def over_sky(colour: Tensor, alpha: Tensor, sky: Tensor, affine: Tensor, picture: Tensor) -> None: ...
def over_sky_backward(
    colour: Tensor,
    alpha: Tensor,
    sky: Tensor,
    affine: Tensor,
    d_picture: Tensor,
    d_colour: Tensor,
    d_alpha: Tensor,
    d_affine: Tensor,
) -> None: ...
def geometry_loss(
    depth_sum: Tensor,
    alpha: Tensor,
    reference: Tensor,
    weight: Tensor,
    sky: Tensor,
    by_disparity: float,
    by_coverage: float,
    whole_weight: float,
    d_depth_sum: Tensor | None,
    d_alpha: Tensor | None,
) -> float: ...
def activate(
    means: Tensor,
    unit: Tensor | None,
    offsets: Tensor | None,
    quaternions: Tensor,
    log_scales: Tensor,
    logits: Tensor,
    sh: Tensor,
    to: int,
    out_means: Tensor,
    out_quaternions: Tensor,
    scales: Tensor,
    opacities: Tensor,
    out_sh: Tensor,
) -> None: ...
def activate_backward(
    unit: Tensor | None,
    to: int,
    scales: Tensor,
    opacities: Tensor,
    d_means: Tensor,
    d_scales: Tensor,
    d_opacities: Tensor,
    d_offsets: Tensor | None,
    d_log_scales: Tensor,
    d_logits: Tensor,
) -> None: ...
def adam(
    values: list[Tensor],
    gradients: list[Tensor],
    means: list[Tensor],
    squares: list[Tensor],
    rates: list[list[float]],
    steps: list[int],
    beta1: float,
    beta2: float,
    epsilon: float,
) -> None: ...

class EncodedNetwork:
    """Weights of a deformation network and the points it reads, by reference."""

def encoded_network(
    tensors: list[Tensor],
    depth: int,
    skip: int,
    means: Tensor,
    centre: Tensor,
    radius: float,
    position_octaves: int,
    time_code: Tensor,
) -> EncodedNetwork: ...
def encoded_network_forward(network: EncodedNetwork, out: Tensor) -> None: ...
def encoded_network_backward(network: EncodedNetwork, d_out: Tensor, gradients: list[Tensor]) -> None: ...

class DenseNetwork:
    """Weights of a network, by reference."""

def dense_network(tensors: list[Tensor], depth: int) -> DenseNetwork: ...
def dense_network_forward(network: DenseNetwork, inputs: Tensor, out: Tensor) -> None: ...
def dense_network_backward(
    network: DenseNetwork, inputs: Tensor, d_out: Tensor, d_inputs: Tensor, gradients: list[Tensor]
) -> None: ...

class Planes:
    """Planes of features as the kernels read them, and the points that read them, by reference."""

def planes(space: list[Tensor], lines: list[Tensor], means: Tensor, low: Tensor, high: Tensor) -> Planes: ...
def planes_forward(planes: Planes, features: Tensor) -> None: ...
def planes_backward(
    planes: Planes, d_features: Tensor, d_space: list[Tensor], d_lines: list[Tensor]
) -> None: ...
def steepness(images: Tensor, weight: float, d_images: Tensor | None) -> float: ...

class Pose:
    """Canonical Gaussians, what the network adds to them and the tracks of a time, by reference."""

def pose(
    means: Tensor,
    quaternions: Tensor,
    log_scales: Tensor,
    logits: Tensor,
    residual: Tensor,
    lifespan: Tensor | None,
    actor: Tensor | None,
    translation: Tensor,
    yaw: Tensor,
    pivot: Tensor,
    up: Tensor,
    time_s: float,
) -> Pose: ...
def pose_forward(
    pose: Pose, means: Tensor, quaternions: Tensor, log_scales: Tensor, logits: Tensor
) -> None: ...
def pose_backward(
    pose: Pose,
    means: Tensor,
    quaternions: Tensor,
    log_scales: Tensor,
    logits: Tensor,
    d_means: Tensor,
    d_quaternions: Tensor,
    d_logits: Tensor,
    d_residual: Tensor,
    d_translation: Tensor,
    d_yaw: Tensor,
) -> None: ...
def keep_freed_memory() -> None: ...
def stage_seconds() -> dict[str, float]: ...
def all_usable(gaussians: Gaussians) -> bool: ...
def set_threads(count: int) -> None: ...
def threads() -> int: ...
def isa() -> str: ...
def sweep_cost(
    grey: np.ndarray,
    mean: np.ndarray,
    variance: np.ndarray,
    greys: list[np.ndarray],
    usable: list[np.ndarray],
    homographies: np.ndarray,
    side: int,
    centre: float,
    noise: float,
    least_z: float,
    cost: np.ndarray,
) -> None: ...
def sweep_misfit(
    grey: np.ndarray,
    greys: list[np.ndarray],
    usable: list[np.ndarray],
    homographies: np.ndarray,
    least_z: float,
    most: float,
    misfit: np.ndarray,
) -> None: ...
def smooth(
    cost: np.ndarray,
    jump_down: np.ndarray,
    jump_right: np.ndarray,
    step: float,
    total: np.ndarray,
    label: np.ndarray,
) -> None: ...
def weighted_median(values: np.ndarray, weights: np.ndarray, median: np.ndarray) -> None: ...
def minimum_cut(gain: np.ndarray, right: np.ndarray, below: np.ndarray, labelled: np.ndarray) -> None: ...
def mix(
    answer: Tensor,
    pictures: Tensor,
    taps: Tensor,
    details: Tensor,
    own: float,
    most_detail: float,
    gentle: float,
    mixed: Tensor,
) -> None: ...
