"""The training of a Cross-View Transformer: predict, compare, step; it goes on where it was stopped.

What is random follows from the seed and the step, so that no state of generators is kept.
"""

import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import torch
from torch import nn

from dreamdrive.compute.device import CPU
from dreamdrive.errors import InputError
from dreamdrive.files.output import claim_folder
from dreamdrive.files.step_log import StepLog
from dreamdrive.models import load_checkpoint, save_checkpoint
from dreamdrive.progress import Progress, silent
from dreamdrive.tasks.perception.network.network import CrossViewTransformer
from dreamdrive.tasks.perception.network.weights import save_cvt
from dreamdrive.tasks.perception.training.batch import BevBatch
from dreamdrive.tasks.perception.training.losses import LossOptions
from dreamdrive.tasks.perception.training.replicas import Replicas, replicated
from dreamdrive.tasks.perception.training.schedule import ScheduleOptions, make_optimiser, set_rate

WEIGHTS = "cvt.safetensors"
LOG = "losses.jsonl"


@dataclass(frozen=True)
class CvtTraining:
    """How a network is trained.

    Attributes:
        schedule: Steps and their rates.
        losses: Weights of the parts of the loss.
        clip: Largest norm of the gradient; published: 5.
        low_precision: Whether convolutions and products of matrices are in bfloat16. The original is not.
        replicas: Into how many parts a batch is cut, each of which one core learns from with norms of its
            own. As many as there are cores are fastest; 1 is exact to a network that sees whole batches.
        frozen_layers: Of ``layers`` of the backbone, the first so many stay as they are, norms included; 0
            is published. It is for trunks that are trained already: the first two are where most time goes.
        seed: Of what the trunk drops.
        log_each: Steps whose losses make one line.
        checkpoint_s: Seconds between two checkpoints.
    """

    schedule: ScheduleOptions = field(default_factory=ScheduleOptions)
    losses: LossOptions = field(default_factory=LossOptions)
    clip: float = 5.0
    low_precision: bool = False
    replicas: int = 1
    frozen_layers: int = 0
    seed: int = 2022
    log_each: int = 20
    checkpoint_s: float = 600.0


def train_cvt(
    network: CrossViewTransformer,
    batches: Callable[[int], Iterable[BevBatch]],
    folder: Path,
    options: CvtTraining = CvtTraining(),
    *,
    data: Mapping[str, str],
    device: torch.device = CPU,
    stop: Callable[[], bool] = lambda: False,
    progress: Progress = silent,
) -> Path | None:
    """Train, or go on from the checkpoint of the folder.

    Args:
        network: What learns, with the weights that it starts from; it is changed.
        batches: Gives the batches from a step on, the same ones each time it is asked.
        folder: Gets ``losses.jsonl``, checkpoints and ``cvt.safetensors``.
        options: How.
        data: What tells data apart, such as digests; a checkpoint has to agree with it.
        device: Where.
        stop: Asked after each step; then a checkpoint is written and no weights.
        progress: Told of steps done.

    Returns:
        The file of weights, or None where it was stopped.

    Raises:
        InputError: The checkpoint is damaged or of another training, or there are too few batches.
        ArithmeticError: A loss is not finite.
    """
    claim_folder(folder, "training")
    _check_replicas(options.replicas, device)
    set_learning(network.to(device), options.frozen_layers)
    optimiser = make_optimiser(network, options.schedule)
    both = network, nn.Module()  # no average is kept beside the network
    first, before_s = load_checkpoint(folder, both, optimiser, options, data)
    log, steps = _Log(folder / LOG, first, options.log_each), options.schedule.steps
    began = saved = time.monotonic()
    done = first
    with replicated(network, options.replicas, options.losses, options.low_precision) as replicas:
        for batch in _counted(batches, first, steps):
            parts = _step(replicas, optimiser, batch.to(device), done, options)
            done += 1
            seconds = before_s + time.monotonic() - began
            log.add(done, seconds, parts, last=done == steps)
            progress(done, steps)
            stopped = done < steps and stop()
            if stopped or done == steps or time.monotonic() - saved > options.checkpoint_s:
                save_checkpoint(folder, done, seconds, both, optimiser, options, data)
                saved = time.monotonic()
            if stopped:
                return None
    network.eval()
    save_cvt(network, folder / WEIGHTS)
    return folder / WEIGHTS


def set_learning(network: CrossViewTransformer, frozen_layers: int) -> None:
    """Let everything learn but the first layers of the backbone."""
    network.requires_grad_(True).train()
    if not frozen_layers:
        return
    layers = getattr(network.encoder.backbone, "layers", None)
    if not isinstance(layers, nn.ModuleList) or not 0 < frozen_layers <= len(layers):
        count = len(layers) if isinstance(layers, nn.ModuleList) else 0
        raise InputError(
            f"frozen_layers {frozen_layers}; this backbone has {count} layers, expected 0 to that"
        )
    for layer in layers[:frozen_layers]:
        layer.requires_grad_(False).eval()


def _check_replicas(count: int, device: torch.device) -> None:
    if count < 1 or (count > 1 and device.type != "cpu"):
        raise InputError(f"{count} replicas on {device}; expected 1, or more on the cores of a CPU")


def _counted(batches: Callable[[int], Iterable[BevBatch]], first: int, steps: int) -> Iterable[BevBatch]:
    """As many batches as there are steps left."""
    done = first
    if done == steps:
        return
    for batch in batches(first):
        yield batch
        done += 1
        if done == steps:
            return
    raise InputError(f"the batches end after step {done} of {steps}; give more data or fewer steps")


def _step(
    replicas: Replicas, optimiser: torch.optim.Optimizer, batch: BevBatch, step: int, options: CvtTraining
) -> dict[str, float]:
    """Learn from a batch; the parts of the loss before that."""
    set_rate(optimiser, step, options.schedule)
    seed = options.seed * 1_000_003 + step
    with torch.random.fork_rng([]):  # of what the caller's backbone may draw from torch's own generator
        torch.manual_seed(seed)
        parts = replicas.learn(batch, seed)
    total = torch.stack(list(parts.values())).sum()
    losses = {name: float(value) for name, value in (parts | {"loss": total}).items()}
    if not torch.isfinite(total):
        raise ArithmeticError(f"the loss of step {step} is not finite: {losses}")
    learned = [each for group in optimiser.param_groups for each in group["params"]]
    nn.utils.clip_grad_norm_(learned, options.clip)
    optimiser.step()
    return losses


class _Log:
    """Means of losses over some steps."""

    def __init__(self, path: Path, first: int, each: int) -> None:
        self._lines, self._each = StepLog(path, first), each
        self._waiting: defaultdict[str, list[float]] = defaultdict(list)

    def add(self, step: int, seconds: float, parts: Mapping[str, float], *, last: bool) -> None:
        """Remember the losses of a step, and write a line where it is time."""
        for name, value in parts.items():
            self._waiting[name].append(value)
        if last or step % self._each == 0:
            means = {name: round(sum(each) / len(each), 6) for name, each in self._waiting.items()}
            self._waiting.clear()
            self._lines.add(step, {"seconds": round(seconds, 1)} | means)
