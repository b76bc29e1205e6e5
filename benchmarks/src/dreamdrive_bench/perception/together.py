"""Many networks trained on the same samples: on cores one each, on a GPU side by side.

What the first layers of the trunk see, which do not learn, is found once. On a GPU a step of a small network
is thousands of small kernels: most of its time goes into starting them. So all samples lie there, a step is
captured once as a CUDA graph, which also chooses its samples and its rate, and the graphs of several networks
run side by side, each in a stream of its own.
"""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from itertools import accumulate, islice
from pathlib import Path

import torch
from torch import Tensor, nn

from dreamdrive.errors import InputError
from dreamdrive.models import load_checkpoint, save_checkpoint
from dreamdrive.tasks.perception import (
    BevSet,
    BevTruth,
    CrossViewTransformer,
    Regime,
    Samples,
    StreetTrunk,
    as_batch,
    bev_losses,
    first_network,
    set_learning,
    shuffled_rows,
)

_WARM_UP = 3
"""Steps before a capture, in which libraries choose their kernels."""
_AT_ONCE = 16
"""Samples whose features are found at once."""
_SAID_EACH = 100


@dataclass(frozen=True)
class Held:
    """Samples on a device: fine features of their pictures, and matrices that are inverted already.

    Attributes:
        which: Of each sample of an arm its row in what follows, where each stands once.
        fine: Features.
        camera_from_pixel: Inverse intrinsics.
        ego_from_camera: Inverse extrinsics.
        truth: Labels.
    """

    which: Tensor
    fine: Tensor
    camera_from_pixel: Tensor
    ego_from_camera: Tensor
    truth: BevTruth

    def __len__(self) -> int:
        return len(self.which)

    def rows(self, rows: Tensor) -> "Held":
        """Some of the samples."""
        own = self.which[rows]
        truth = BevTruth(*(getattr(self.truth, each.name)[own] for each in fields(BevTruth)))
        return Held(own, self.fine[own], self.camera_from_pixel[own], self.ego_from_camera[own], truth)


@torch.no_grad()
def held(sets: Sequence[BevSet], regime: Regime, device: torch.device) -> Held:
    """All samples of sets on a device, in their order; a set may stand there several times.

    Args:
        sets: Of recorded, rendered or warped samples.
        regime: One whose trunk learns nothing before its last layer.
        device: Where.
    """
    if regime.network.trunk != "street" or regime.training.frozen_layers < 2:
        raise InputError("networks are trained together on the trunk street, with two frozen layers or more")
    once = {each.folder: each for each in sets}
    samples = Samples(list(once.values()))
    starts = dict(zip(once, accumulate((len(each) for each in once.values()), initial=0), strict=False))
    which = [starts[each.folder] + row for each in sets for row in range(len(each))]
    with ThreadPoolExecutor() as pool:
        batch = as_batch(list(pool.map(samples.__getitem__, range(len(samples)))))
    return Held(
        torch.tensor(which, device=device),
        _fine(batch.pictures, regime, device),
        torch.linalg.inv(batch.pixel_from_camera).to(device),
        torch.linalg.inv(batch.camera_from_ego).to(device),
        batch.truth.to(device),
    )


def _fine(pictures: Tensor, regime: Regime, device: torch.device) -> Tensor:
    """What the frozen layers see."""
    encoder = first_network(regime).to(device).eval().encoder
    assert isinstance(encoder.backbone, StreetTrunk)
    parts: list[Tensor] = []
    for some in pictures.split(_AT_ONCE):
        normal = encoder.normalised(some.to(device).float() / 255)
        with torch.autocast(device.type, torch.bfloat16, enabled=regime.training.low_precision):
            parts.append(encoder.backbone.fine(normal).unflatten(0, some.shape[:2]))
    return torch.cat(parts)


class Student:
    """A network and the steps of its training; samples, rates and orders are those of ``train_on``.

    Args:
        samples: On a device.
        regime: How it is trained; as one replica.
    """

    def __init__(self, samples: Held, regime: Regime) -> None:
        self._samples, self._options = samples, regime.training
        schedule, device = regime.training.schedule, samples.fine.device
        self.network: CrossViewTransformer = first_network(regime).to(device)
        set_learning(self.network, regime.training.frozen_layers)
        trunk = self.network.encoder.backbone
        assert isinstance(trunk, StreetTrunk)
        self._last = trunk.layers[2]
        rows = shuffled_rows(len(samples), regime.batch, regime.training.seed)
        self._rows = torch.tensor(list(islice(rows, schedule.steps)), device=device)
        rates = [schedule.rate_at(step) for step in range(schedule.steps)]
        self._rates = torch.tensor(rates, device=device)
        self.losses = torch.zeros(schedule.steps, device=device)
        self._done = torch.zeros(1, dtype=torch.long, device=device)
        self._learned = [each for each in self.network.parameters() if each.requires_grad]
        self._rate = torch.tensor(rates[0], device=device)
        self._optimiser = torch.optim.AdamW(
            self._learned,
            lr=self._rate,
            weight_decay=schedule.weight_decay,
            fused=True,
            capturable=device.type == "cuda",
        )

    def step(self) -> None:
        """Learn from the next batch; nothing waits for the device."""
        self._rate.copy_(self._rates[self._done][0])
        batch, low = self._samples.rows(self._rows[self._done][0]), self._options.low_precision
        cameras, size = (batch.camera_from_pixel, batch.ego_from_camera), batch.fine.shape[:2]
        with torch.autocast(self._rate.device.type, torch.bfloat16, enabled=low, cache_enabled=False):
            fine = batch.fine.flatten(0, 1)
            if not fine.is_cuda:  # filters of single channels take a third of the time so
                fine = fine.contiguous(memory_format=torch.channels_last)
            coarse = self._last(fine).unflatten(0, size)
            said = self.network.answer([fine.unflatten(0, size), coarse], *cameras)
        loss = torch.stack(list(bev_losses(said, batch.truth, self._options.losses).values())).sum()
        self._optimiser.zero_grad()
        loss.backward()  # pyright: ignore[reportUnknownMemberType]
        nn.utils.clip_grad_norm_(self._learned, self._options.clip)
        self._optimiser.step()
        self.losses[self._done] = loss.detach()
        self._done += 1

    def start_again(self, first: dict[str, Tensor]) -> None:
        """Undo all steps: weights become the first ones, the optimiser and the counter zero."""
        self.network.load_state_dict(first)
        self._done.zero_()
        for state in self._optimiser.state.values():
            for value in state.values():
                value.zero_()

    def save(self, folder: Path, data: Mapping[str, str]) -> None:
        """Write a checkpoint; ``data`` tells trainings apart."""
        folder.mkdir(parents=True, exist_ok=True)
        networks = self.network, nn.Module()  # no average is kept beside the network
        save_checkpoint(folder, int(self._done), 0.0, networks, self._optimiser, self._options, data)

    def go_on(self, folder: Path, data: Mapping[str, str]) -> None:
        """Go back to the checkpoint of a folder, if there is one."""
        networks = self.network, nn.Module()
        done, _ = load_checkpoint(folder, networks, self._optimiser, self._options, data)
        for group in self._optimiser.param_groups:
            group["lr"] = self._rate  # the optimiser took a copy
        self._done.fill_(done)

    def learn(self) -> Iterator[int]:
        """Take all steps that are left; says the steps done."""
        for step in range(int(self._done), len(self.losses)):
            self.step()
            if (step + 1) % _SAID_EACH == 0:
                self.check()  # before it is kept, as who goes on from there sees no earlier loss
                yield step + 1
        self.check()

    def check(self) -> None:
        """Raise an error where a loss was not finite."""
        if not torch.isfinite(self.losses).all():
            raise ArithmeticError("a loss is not finite")

    def capture(self) -> "Captured":
        """The step as a graph of a stream of its own."""
        stream, first = torch.cuda.Stream(), {k: v.clone() for k, v in self.network.state_dict().items()}
        stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(stream):
            for _ in range(_WARM_UP):
                self.step()
        stream.synchronize()
        graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(graph, stream=stream):
            self.step()
        self.start_again(first)
        torch.cuda.synchronize()
        return Captured(graph, stream, len(self._rates))


@dataclass(frozen=True)
class Captured:
    """A step that runs by itself."""

    graph: torch.cuda.CUDAGraph
    stream: torch.cuda.Stream
    steps: int


def train_together(students: Sequence[Student]) -> Iterator[int]:
    """Train all of them on their GPU; says the steps done."""
    torch.backends.cudnn.benchmark = True
    yield from _replayed([each.capture() for each in students])
    for each in students:
        each.check()


def _replayed(captured: Sequence["Captured"]) -> Iterator[int]:
    for step in range(max(each.steps for each in captured)):
        for each in captured:
            if step < each.steps:
                with torch.cuda.stream(each.stream):
                    each.graph.replay()
        if (step + 1) % _SAID_EACH == 0:
            torch.cuda.synchronize()
            yield step + 1
    torch.cuda.synchronize()
