"""Training of networks that mend pictures, on pairs; what is random follows from the seed and the step."""

import json
import time
from collections.abc import Callable
from copy import deepcopy
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from safetensors.torch import save_file
from torch import Tensor, nn

from dreamdrive.compute.device import CPU
from dreamdrive.errors import InputError
from dreamdrive.evaluate.networks import lpips, stlpips
from dreamdrive.files.output import claim_folder, new_file
from dreamdrive.files.step_log import StepLog
from dreamdrive.models import load_checkpoint, save_checkpoint
from dreamdrive.street_network import StreetNetwork, load_knowledge
from dreamdrive_train.pairs.files import CROP_PX, PlaneRange

TRUNK = "alex"
"""Of the shift-tolerant LPIPS that is learned from: results are judged by that of VGG."""
_LOG = "losses.jsonl"
_LEVELS = 3


@dataclass(frozen=True)
class PairTraining:
    """How the network is trained.

    Attributes:
        steps: Of the whole training.
        batch: Pairs a step.
        crop_px: Side of the square that is cut from each.
        rate: Largest step of Adam; it rises for ``warm`` steps and falls as a cosine.
        warm: Steps until then.
        perceptual: Weight of the distance in features of the street network's encoder, beside L1.
        stlpips: Weight of the shift-tolerant LPIPS of AlexNet, which the extra ``metrics`` installs; at 0 it
            is not needed.
        spoilt: How much more counts what is spoilt.
        average: Share of the averaged weights that a step keeps.
        seed: Of everything random.
    """

    steps: int = 12_000
    batch: int = 4
    crop_px: int = CROP_PX
    rate: float = 4e-4
    warm: int = 200
    perceptual: float = 0.2
    stlpips: float = 0.0
    spoilt: float = 3.0
    average: float = 0.999
    seed: int = 0


@dataclass(frozen=True)
class Judge:
    """Networks in whose features a picture is compared with the truth."""

    street: StreetNetwork
    distance: lpips.PerceptualDistance | None


def _as_it_is(told: Tensor, truth: Tensor, generator: np.random.Generator) -> tuple[Tensor, Tensor]:
    return told, truth


@dataclass(frozen=True)
class PairTask:
    """What is learned from pairs.

    Attributes:
        make: Makes the network.
        mended: What a network says of what it is told: RGB (N, 3, H, W).
        spoilt: How spoilt what it is told is, from 0 to 1 (N, 1, H, W).
        range: Of the maps in a pair.
        file: Name of the weights.
        varied: Changes what the network is told and the truth alike, by what a generator draws.
    """

    make: Callable[[], nn.Module]
    mended: Callable[[nn.Module, Tensor], Tensor]
    spoilt: Callable[[Tensor], Tensor]
    range: PlaneRange
    file: str
    varied: Callable[[Tensor, Tensor, np.random.Generator], tuple[Tensor, Tensor]] = _as_it_is


def train_on_pairs(
    task: PairTask,
    pairs: list[Path],
    out: Path,
    knowledge: str,
    options: PairTraining,
    *,
    licence: str = "Apache-2.0",
    device: torch.device = CPU,
    checkpoint_s: float = 120.0,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[int, int, float], None] = lambda step, steps, loss: None,
) -> Path | None:
    """Train on pairs and write the weights; the same call goes on where it stopped.

    ``stop`` is asked after each step; then a checkpoint is written and no weights.
    """
    if not pairs:
        raise InputError("there are no pairs to train on: nothing could be made of any of the sources")
    claim_folder(out, "training")
    torch.manual_seed(options.seed)
    network = task.make().to(device)
    averaged = deepcopy(network).requires_grad_(False)
    optimiser = torch.optim.Adam(network.parameters(), lr=options.rate, betas=(0.9, 0.99))
    judge = Judge(load_knowledge(knowledge).to(device), _distance(options, device))
    both, data = (network, averaged), dict[str, str]()
    done, before_s = load_checkpoint(out, both, optimiser, options, data)
    log, began = StepLog(out / _LOG, done), time.monotonic()
    saved, losses = began, list[float]()
    for step in range(done, options.steps):
        for group in optimiser.param_groups:
            group["lr"] = options.rate * _share(step, options)
        batch = tuple(each.to(device) for each in batch_of(task, pairs, step, options))
        loss = _step(task, network, optimiser, judge, batch, options)
        with torch.no_grad():
            keep = min(options.average, (step + 1) / (step + 10))
            for mean, value in zip(averaged.parameters(), network.parameters(), strict=True):
                mean.lerp_(value, 1 - keep)
        losses.append(loss)
        progress(step + 1, options.steps, loss)
        stopped = step + 1 < options.steps and stop()
        if stopped or time.monotonic() - saved > checkpoint_s or step + 1 == options.steps:
            spent_s = before_s + time.monotonic() - began
            save_checkpoint(out, step + 1, spent_s, both, optimiser, options, data)
            log.add(step + 1, {"loss": round(float(np.mean(losses)), 5)})
            saved, losses = time.monotonic(), []
        if stopped:
            return None
    return _write(averaged, out / task.file, licence, options)


def _distance(options: PairTraining, device: torch.device) -> lpips.PerceptualDistance | None:
    if not options.stlpips:
        return None
    return stlpips.load_stlpips(TRUNK).to(device)


def _write(averaged: nn.Module, path: Path, licence: str, options: PairTraining) -> Path:
    state = {name: value.half().cpu().contiguous() for name, value in averaged.state_dict().items()}
    with new_file(path) as partial:
        save_file(state, partial, {"licence": licence, "options": json.dumps(asdict(options))})
    return path


def _share(step: int, options: PairTraining) -> float:
    left = 0.5 * (1 + np.cos(np.pi * step / options.steps))
    return float(min(1.0, (step + 1) / options.warm) * (0.02 + 0.98 * left))


def batch_of(
    task: PairTask, pairs: list[Path], step: int, options: PairTraining
) -> tuple[Float[Tensor, "n c y x"], Float[Tensor, "n 3 y x"], Float[Tensor, "n 1 y x"]]:
    """What the network is told at a step, the truth and what of it counts."""
    generator = np.random.default_rng([options.seed, step])
    told, truth, counts = task.range.batch(pairs, generator, options.batch, options.crop_px)
    return *task.varied(told, truth, generator), counts


def _step(
    task: PairTask,
    network: nn.Module,
    optimiser: torch.optim.Optimizer,
    judge: Judge,
    batch: tuple[Tensor, ...],
    options: PairTraining,
) -> float:
    told, truth, counts = batch
    said = task.mended(network, told)
    weight = counts * (1 + options.spoilt * task.spoilt(told))
    loss = (weight * (said - truth).abs()).sum() / (3 * weight.sum() + 1)
    true_there = torch.where(counts > 0.5, truth, said.detach())
    if judge.distance is not None:
        half = max(1, len(said) // 2)  # of the pairs: each takes twice as long as all else
        apart = judge.distance.of(2 * said[:half] - 1, 2 * true_there[:half] - 1)
        loss = loss + options.stlpips * apart.mean()
    there, wanted = judge.street.encoder(said), judge.street.encoder(true_there)
    for a, b in zip(there[:_LEVELS], wanted[:_LEVELS], strict=True):
        scale = b.square().mean().sqrt() + 1e-3
        loss = loss + options.perceptual / _LEVELS * (a - b.detach()).abs().mean() / scale
    optimiser.zero_grad(set_to_none=True)
    loss.backward()
    torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
    optimiser.step()
    return float(loss.detach())
