"""Batches learned from in parts at the same time, one part a core.

Two threads that share each operation wait for one another hundreds of times a step. That costs a twentieth of
a step on idle cores, and up to ten steps where others use a core, too. Two that share weights alone need not.
"""

from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from copy import deepcopy

import torch
from torch import Tensor, nn

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.tasks.perception.network.backbone import EfficientNetFront
from dreamdrive.tasks.perception.network.network import CrossViewTransformer
from dreamdrive.tasks.perception.training.batch import BevBatch
from dreamdrive.tasks.perception.training.losses import LossOptions, bev_losses

Learned = tuple[list[Tensor | None], dict[str, Tensor]]


class Replicas:
    """A network and copies that share its weights and have norms of their own, as on several devices.

    Those of the network see the first part of each batch alone, and their averages are what is kept.

    Args:
        networks: The network, then its copies.
        losses: Weights of the parts of the loss.
        low_precision: Whether predictions are made in bfloat16.
        pool: Where parts are learned from.
    """

    def __init__(
        self,
        networks: list[CrossViewTransformer],
        losses: LossOptions,
        low_precision: bool,
        pool: ThreadPoolExecutor,
    ) -> None:
        self._networks, self._losses, self._low_precision, self._pool = networks, losses, low_precision, pool
        self._draws = [torch.Generator() for _ in networks]
        for network, draws in zip(networks, self._draws, strict=True):
            draw_from(network, draws)

    def learn(self, batch: BevBatch, seed: int) -> dict[str, Tensor]:
        """Set the gradients of all that learns to those of a batch.

        Args:
            batch: The samples; parts are of about equal size.
            seed: Of what the trunk drops.

        Returns:
            The parts of the loss, means over the samples.
        """
        count = min(len(self._networks), len(batch))
        cuts = [len(batch) * each // count for each in range(count + 1)]

        def learn(index: int) -> Learned:
            part = batch.part(cuts[index], cuts[index + 1])
            self._draws[index].manual_seed(seed * len(self._networks) + index)
            return self._learn(self._networks[index], part, len(part) / len(batch))

        # One part needs no thread, and then torch's own may help.
        found = [learn(0)] if count == 1 else list(self._pool.map(learn, range(count)))
        learned = _learned(self._networks[0])
        for each, gradients in zip(learned, zip(*(part[0] for part in found), strict=True), strict=True):
            each.grad = _laid_out(_sum(gradients), each)
        return {name: torch.stack([part[1][name] for part in found]).sum() for name in found[0][1]}

    def _learn(self, network: CrossViewTransformer, batch: BevBatch, share: float) -> Learned:
        device = batch.pictures.device.type
        with torch.autocast(device, torch.bfloat16, enabled=self._low_precision):
            said = network(batch.pictures, batch.pixel_from_camera, batch.camera_from_ego)
        parts = {name: share * value for name, value in bev_losses(said, batch.truth, self._losses).items()}
        total = torch.stack(list(parts.values())).sum()
        gradients = torch.autograd.grad(total, _learned(network), allow_unused=True)
        return list(gradients), {name: value.detach() for name, value in parts.items()}


@contextmanager
def replicated(
    network: CrossViewTransformer, count: int, losses: LossOptions, low_precision: bool
) -> Generator[Replicas, None, None]:
    """Replicas of a network, each on one thread of its own; with one replica torch uses its threads."""
    weights = {id(each): each for each in network.parameters()}
    copies = [deepcopy(network, dict[int, object](weights)) for _ in range(count - 1)]
    with ThreadPoolExecutor(count) as pool, one_torch_thread() if copies else nullcontext():
        try:
            yield Replicas([network, *copies], losses, low_precision, pool)
        finally:
            draw_from(network, None)


def draw_from(network: CrossViewTransformer, draws: torch.Generator | None) -> None:
    """Let a trunk of EfficientNet draw what it drops from a generator; None for torch's own."""
    trunk = network.encoder.backbone
    if isinstance(trunk, EfficientNetFront):
        trunk.draw_from(draws)


def _learned(network: nn.Module) -> list[nn.Parameter]:
    return [each for each in network.parameters() if each.requires_grad]


def _sum(gradients: tuple[Tensor | None, ...]) -> Tensor | None:
    """In the order of the parts, so that the result is always the same."""
    known = [each for each in gradients if each is not None]
    return torch.stack(known).sum(dim=0) if len(known) > 1 else (known or [None])[0]


def _laid_out(gradient: Tensor | None, like: Tensor) -> Tensor | None:
    """In memory as its weights are: the fused optimiser mixes up others on a CPU, and a GPU refuses them."""
    if gradient is None or gradient.stride() == like.stride():
        return gradient
    return torch.empty_like(like).copy_(gradient)
