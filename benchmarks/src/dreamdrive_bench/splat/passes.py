"""One forward pass, or one forward and backward pass, of the splat over a street; and their times."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from dreamdrive.scene.gaussians import SH_C0
from dreamdrive.splat import rasterize
from dreamdrive_bench.splat.streets import pinhole_of

FIXED = "camera_from_world"


@dataclass(frozen=True)
class View:
    """Tensors and pinhole that ``rasterize`` takes, and the gradient that comes back to the image."""

    tensors: dict[str, Tensor]
    camera: dict[str, Any]
    upstream: Tensor

    def leaves(self) -> dict[str, Tensor]:
        """The tensors with gradients wanted for means, quaternions, scales, opacities and colours."""
        return {k: v.detach().requires_grad_(k != FIXED) for k, v in self.tensors.items()}


def view_of(scene: dict[str, np.ndarray]) -> View:
    """A street's arrays as arguments; its plain colours become spherical harmonics of degree 0."""
    values = {
        "means": scene["means"],
        "quaternions": scene["quats"],
        "scales": scene["scales"],
        "opacities": scene["opacities"],
        "sh": ((scene["colors"] - 0.5) / SH_C0)[:, None],
        FIXED: scene["viewmat"],
    }
    tensors = {name: torch.from_numpy(np.array(value, np.float32)) for name, value in values.items()}
    return View(tensors, pinhole_of(scene), torch.from_numpy(np.array(scene["v_img"], np.float32)))


def forward_of(view: View, backend: str = "native") -> Callable[[], object]:
    """A forward pass that keeps nothing for a backward pass."""
    return lambda: rasterize(**view.tensors, **view.camera, backend=backend)


def forward_backward_of(view: View, backend: str = "native") -> Callable[[], object]:
    """Both passes, with gradients to all but the pose."""
    leaves = view.leaves()
    wanted = [leaf for leaf in leaves.values() if leaf.requires_grad]

    def run() -> object:
        image = rasterize(**leaves, **view.camera, backend=backend).colour
        return torch.autograd.grad(image, wanted, view.upstream)

    return run


def times_ms(
    run: Callable[[], object],
    repeat: int,
    after_each: Callable[[], object] = lambda: None,
    clock: Callable[[], float] = time.perf_counter,
) -> list[float]:
    """Times of ``repeat`` runs after two that warm up, sorted; ``after_each`` of them is not timed."""
    taken = []
    for index in range(repeat + 2):
        start = clock()
        run()
        seconds = clock() - start
        if index >= 2:
            taken.append(1e3 * seconds)
            after_each()
    return sorted(taken)


def best_and_median(times: list[float]) -> tuple[float, float]:
    """Of sorted times."""
    return times[0], times[len(times) // 2]
