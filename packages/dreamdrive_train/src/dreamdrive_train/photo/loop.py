"""The training itself, resumable: what is random follows from the seed and the step."""

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
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.files.output import claim_folder, new_file
from dreamdrive.files.step_log import StepLog
from dreamdrive.models import load_checkpoint, save_checkpoint
from dreamdrive.prior.photo.network import CHANNELS, PhotoNetwork
from dreamdrive.street_network import StreetNetwork, load_knowledge
from dreamdrive_train.photo.pairs import HIGH, LOW

WEIGHTS = "photo.safetensors"
_LOG = "losses.jsonl"


@dataclass(frozen=True)
class PhotoTraining:
    """How the network is trained.

    Attributes:
        steps: Of the whole training.
        batch: Pairs a step.
        crop_px: Side of the square that is cut from each.
        rate: Largest step of Adam; it rises for ``warm`` steps and falls as a cosine.
        warm: Steps until then.
        perceptual: Weight of the distance in features of the street network's encoder, beside L1.
        spoilt: How much more what is made up, empty or stretched counts.
        average: Share of the averaged weights that a step keeps.
        seed: Of everything random.
    """

    steps: int = 12_000
    batch: int = 4
    crop_px: int = 144
    rate: float = 4e-4
    warm: int = 200
    perceptual: float = 0.2
    spoilt: float = 3.0
    average: float = 0.999
    seed: int = 0


def train_photo(
    pairs: list[Path],
    out: Path,
    knowledge: str,
    options: PhotoTraining = PhotoTraining(),
    *,
    licence: str = "Apache-2.0",
    checkpoint_s: float = 120.0,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[int, int, float], None] = lambda step, steps, loss: None,
) -> Path | None:
    """Train on pairs and write ``photo.safetensors``; the same call goes on where it stopped.

    ``stop`` is asked after each step; then a checkpoint is written and no weights.
    """
    if not pairs:
        raise InputError("there are no pairs to train on: no street was seen in any of the pictures")
    claim_folder(out, "training")
    torch.manual_seed(options.seed)
    network = PhotoNetwork()
    averaged = deepcopy(network).requires_grad_(False)
    optimiser = torch.optim.Adam(network.parameters(), lr=options.rate, betas=(0.9, 0.99))
    judge = load_knowledge(knowledge)
    both, data = (network, averaged), dict[str, str]()
    done, before_s = load_checkpoint(out, both, optimiser, options, data)
    log, began = StepLog(out / _LOG, done), time.monotonic()
    saved, losses = began, list[float]()
    for step in range(done, options.steps):
        for group in optimiser.param_groups:
            group["lr"] = options.rate * _share(step, options)
        loss = _step(network, optimiser, judge, batch_of(pairs, step, options), options)
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
    state = {name: value.half().contiguous() for name, value in averaged.state_dict().items()}
    with new_file(out / WEIGHTS) as partial:
        save_file(state, partial, {"licence": licence, "options": json.dumps(asdict(options))})
    return out / WEIGHTS


def _share(step: int, options: PhotoTraining) -> float:
    left = 0.5 * (1 + np.cos(np.pi * step / options.steps))
    return float(min(1.0, (step + 1) / options.warm) * (0.02 + 0.98 * left))


def batch_of(
    pairs: list[Path], step: int, options: PhotoTraining
) -> tuple[Float[Tensor, "n 11 y x"], Float[Tensor, "n 3 y x"], Float[Tensor, "n 1 y x"]]:
    """What the network is told, the truth and what of it counts, of squares of some pairs."""
    generator, side = np.random.default_rng([options.seed, step]), options.crop_px
    cuts: list[np.ndarray] = []
    for index in generator.integers(len(pairs), size=options.batch):
        planes = np.load(pairs[index], mmap_mode="r", allow_pickle=False)
        rows, columns = planes.shape[1] - side, planes.shape[2] - side
        top, left = (int(generator.integers(most // 2 + 1)) * 2 for most in (rows, columns))
        cut = planes[:, top : top + side, left : left + side]
        cuts.append(cut[:, :, ::-1] if generator.integers(2) else cut)
    values = torch.from_numpy(np.stack(cuts).astype(np.float32) / 255)
    low, high = (torch.from_numpy(each)[:, None, None] for each in (LOW, HIGH))
    return low + values[:, :CHANNELS] * (high - low), values[:, CHANNELS:-1], values[:, -1:]


def _step(
    network: PhotoNetwork,
    optimiser: torch.optim.Optimizer,
    judge: StreetNetwork,
    batch: tuple[Tensor, Tensor, Tensor],
    options: PhotoTraining,
) -> float:
    seen, truth, counts = batch
    said, _ = network(seen)
    spoilt = torch.maximum(torch.maximum(1 - seen[:, 3:4], seen[:, 4:5]), 0.5 * seen[:, 5:6].clamp(0, 1))
    weight = counts * (1 + options.spoilt * spoilt)
    loss = (weight * (said - truth).abs()).sum() / (3 * weight.sum() + 1)
    true_there = torch.where(counts > 0.5, truth, said.detach())
    there, wanted = judge.encoder(said), judge.encoder(true_there)
    for a, b in zip(there[:3], wanted[:3], strict=True):
        scale = b.square().mean().sqrt() + 1e-3
        loss = loss + options.perceptual / 3 * (a - b.detach()).abs().mean() / scale
    optimiser.zero_grad(set_to_none=True)
    loss.backward()
    torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
    optimiser.step()
    return float(loss.detach())
