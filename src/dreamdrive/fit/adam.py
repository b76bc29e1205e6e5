"""Adam (Kingma and Ba 2015) for sets of Gaussians, on all threads."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import torch
from torch import Tensor

from dreamdrive import _native
from dreamdrive.compute.device import in_core

BETA1, BETA2, EPSILON = 0.9, 0.999, 1e-15


@dataclass
class Moments:
    """What Adam remembers of one tensor.

    Attributes:
        mean: Running mean of the gradient, of the tensor's shape.
        square: Running mean of its square.
        steps: Steps taken.
    """

    mean: Tensor
    square: Tensor
    steps: int = 0

    def changed(self, change: Callable[[Tensor], Tensor]) -> "Moments":
        """The same after surgery on the rows."""
        return Moments(change(self.mean), change(self.square), self.steps)


@torch.no_grad()
def adam_step(
    leaves: Mapping[str, Tensor], moments: Mapping[str, Moments], rates: Mapping[str, Sequence[float]]
) -> None:
    """One step of ``torch.optim.Adam`` with betas and epsilon of 3DGS; then the gradients are forgotten.

    Args:
        leaves: Contiguous float32 tensors by name; those without a gradient stay as they are.
        moments: Of each leaf, changed in place.
        rates: Step sizes of each leaf, taken in turn by its numbers: one for all of them, or 3 K for the
            coefficients of (N, K, 3).
    """
    moving = {name: leaf for name, leaf in leaves.items() if leaf.grad is not None}
    for name in moving:
        moments[name].steps += 1
    if not all(map(in_core, moving.values())):
        for name, leaf in moving.items():
            _torch_step(leaf, moments[name], tuple(rates[name]))
        return
    _native.adam(
        [leaf.detach() for leaf in moving.values()],
        [leaf.grad.contiguous() for leaf in moving.values() if leaf.grad is not None],
        [moments[name].mean for name in moving],
        [moments[name].square for name in moving],
        [list(rates[name]) for name in moving],
        [moments[name].steps for name in moving],
        BETA1,
        BETA2,
        EPSILON,
    )
    for leaf in moving.values():
        torch.autograd.graph.increment_version(leaf)
        leaf.grad = None


def _torch_step(leaf: Tensor, moments: Moments, rates: tuple[float, ...]) -> None:
    assert leaf.grad is not None
    moments.mean.lerp_(leaf.grad, 1 - BETA1)
    moments.square.mul_(BETA2).addcmul_(leaf.grad, leaf.grad, value=1 - BETA2)
    leaf.grad = None
    # In the memory of one such tensor: three more are the most that a whole step would take.
    step = (moments.square / (1 - BETA2**moments.steps)).sqrt_().add_(EPSILON)
    torch.div(moments.mean, step, out=step).div_(1 - BETA1**moments.steps)
    each = rates[0] if len(rates) == 1 else _rates(rates, leaf.device).view(leaf.shape[1:])
    leaf.sub_(step.mul_(each))


@lru_cache(maxsize=64)
def _rates(rates: tuple[float, ...], device: torch.device) -> Tensor:
    """Step sizes on the device; kept, since each copy to it is waited for."""
    return torch.tensor(rates, dtype=torch.float32, device=device)
