"""The training of the street network: draw pictures, compare, step, average."""

import time
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from pathlib import Path

import torch
from torch import Tensor

from dreamdrive.files.output import claim_folder
from dreamdrive.files.step_log import StepLog
from dreamdrive.models.checkpoint import load_checkpoint, save_checkpoint
from dreamdrive.progress import Progress, silent
from dreamdrive.street_network.network import StreetNetwork
from dreamdrive_train.street_network.data.loader import Loader
from dreamdrive_train.street_network.data.mixture import Entry, Mixture
from dreamdrive_train.street_network.judge import judge
from dreamdrive_train.street_network.losses import losses, taught_losses
from dreamdrive_train.street_network.optimiser import average, freeze, frozen, make_optimiser, set_rates
from dreamdrive_train.street_network.options import TrainingOptions
from dreamdrive_train.street_network.targets import Batch

LOG = "losses.jsonl"


class _Trainer:
    """The state of a training between two steps.

    Attributes:
        network: What learns.
        averaged: Its average over the last steps, which is judged and written, and teaches.
    """

    def __init__(self, network: StreetNetwork, options: TrainingOptions, device: torch.device) -> None:
        self.options, self._device = options, device
        self.network = network.to(device).requires_grad_(True)
        self.averaged = deepcopy(self.network).eval().requires_grad_(False)
        freeze(self.network.encoder, options)
        self.optimiser = make_optimiser(self.network, options)

    def step(self, step: int, batch: Batch) -> dict[str, float]:
        """Learn from a batch; the parts of the loss before that."""
        batch, options = batch.to(self._device), self.options
        self._set_training()
        set_rates(self.optimiser, step, options)
        with torch.autocast(self._device.type, torch.bfloat16, enabled=options.low_precision):
            said = self.network(batch.pictures.float() / 255)
        parts = losses(said, batch, options.losses)
        teaching = self._teaching(step)
        if teaching and len(batch.clean):
            with (
                torch.inference_mode(),
                torch.autocast(self._device.type, torch.bfloat16, enabled=options.low_precision),
            ):
                teacher = self.averaged(batch.clean.float().flip(3) / 255)
            taught = taught_losses(said, teacher, batch, options.losses)
            parts |= {name: teaching * value for name, value in taught.items()}
        total = torch.stack(list(parts.values())).sum()
        if not torch.isfinite(total):
            raise ArithmeticError(f"the loss of step {step} is not finite: {_numbers(parts)}")
        self.optimiser.zero_grad(set_to_none=True)
        total.backward()
        learned = [each for each in self.network.parameters() if each.requires_grad]
        torch.nn.utils.clip_grad_norm_(learned, options.clip, foreach=True)
        self.optimiser.step()
        average(self.averaged, self.network, step, options.average)
        return _numbers(parts) | {"loss": float(total.detach())}

    def _set_training(self) -> None:
        self.network.train()
        for part in frozen(self.network.encoder, self.options):
            part.eval()

    def _teaching(self, step: int) -> float:
        """Weight of what the teacher says at a step."""
        start = self.options.teach_from
        done = step / self.options.steps
        return min(1.0, max(0.0, done / start - 1)) if start > 0 else 1.0


def train(
    network: StreetNetwork,
    mixture: Mixture,
    kept_out: Sequence[Entry],
    folder: Path,
    options: TrainingOptions,
    *,
    data: Mapping[str, str],
    device: torch.device,
    publish: Callable[[int, StreetNetwork, dict[str, float]], None],
    stop: Callable[[], bool] = lambda: False,
    progress: Progress = silent,
) -> dict[str, float] | None:
    """Train, or go on from the checkpoint of the folder.

    Args:
        network: What learns, with the weights that it starts from.
        mixture: What it learns from.
        kept_out: What it is judged by.
        folder: Gets ``losses.jsonl`` and checkpoints.
        options: How.
        data: Digests of the records, which a checkpoint has to agree with.
        device: Where.
        publish: Given the steps done, the averaged network and its last figures, with each checkpoint.
        stop: Asked after each step; then a checkpoint is written.
        progress: Told of steps done.

    Returns:
        Figures of the averaged network, or None where it was stopped.
    """
    claim_folder(folder, "training")
    trainer = _Trainer(network, options, device)
    both = trainer.network, trainer.averaged
    first, seconds = load_checkpoint(folder, both, trainer.optimiser, options, data)
    began = saved = time.monotonic()

    def save(done: int) -> None:
        spent = seconds + time.monotonic() - began
        save_checkpoint(folder, done, spent, both, trainer.optimiser, options, data)

    figures: dict[str, float] = {}
    log = _Log(folder / LOG, first)
    loader = Loader(mixture, options.loader, options.seed)
    for step, batch in enumerate(loader.batches(first, options.steps - first), start=first):
        log.add(trainer.step(step, batch))
        done = step + 1
        if done % options.log_each == 0 or done == options.steps:
            log.write(done, seconds + time.monotonic() - began)
        progress(done, options.steps)
        if kept_out and (done % options.validate_each == 0 or done == options.steps):
            figures = judge(trainer.averaged, kept_out)
            log.judged(done, figures)
        stopped = done < options.steps and stop()
        if stopped or done == options.steps or time.monotonic() - saved > options.checkpoint_s:
            save(done)
            publish(done, trainer.averaged, figures)
            saved = time.monotonic()
        if stopped:
            return None
    if first == options.steps and kept_out:
        figures = judge(trainer.averaged, kept_out)
    return figures


class _Log:
    """Means of losses since the last line, and figures."""

    def __init__(self, path: Path, first: int) -> None:
        self._lines = StepLog(path, first)
        self._waiting: list[dict[str, float]] = []

    def add(self, parts: dict[str, float]) -> None:
        """Remember the losses of a step."""
        self._waiting.append(parts)

    def write(self, step: int, seconds: float) -> None:
        """A line with the means since the last; seconds since the training began."""
        names = dict.fromkeys(name for parts in self._waiting for name in parts)
        means = {
            name: sum(parts.get(name, 0.0) for parts in self._waiting) / len(self._waiting) for name in names
        }
        self._waiting.clear()
        self._lines.add(step, {"seconds": round(seconds, 1)} | _rounded(means))

    def judged(self, step: int, figures: dict[str, float]) -> None:
        """A line with figures."""
        self._lines.add(step, {"figures": _rounded(figures)})


def _rounded(values: Mapping[str, float]) -> dict[str, object]:
    return {name: round(value, 6) for name, value in values.items()}


def _numbers(parts: Mapping[str, Tensor]) -> dict[str, float]:
    return {name: float(value.detach()) for name, value in parts.items()}
