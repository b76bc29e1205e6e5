"""Trainings of the experiment and their tests, each kept once it is done."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from shutil import rmtree
from typing import Any

import torch

from dreamdrive.compute.device import CPU
from dreamdrive.files.digest import digest
from dreamdrive.tasks.perception import QUICK, BevSet, CrossViewTransformer, Regime, Samples, score
from dreamdrive_bench.common.keep import is_current, save
from dreamdrive_bench.common.twin import TWIN
from dreamdrive_bench.common.workers import Task, work_off
from dreamdrive_bench.perception.protocol import Places, Protocol
from dreamdrive_bench.perception.together import Held, Student, held, train_together

SIDE_BY_SIDE = 8
"""Networks on a GPU: a step of one takes 6 ms then, 10 alone, and 8 of 25."""


@dataclass(frozen=True)
class Trial:
    """A network of an arm and a seed.

    Attributes:
        arm: What it learns from.
        seed: Of its first weights and the order of its samples.
        runs: Folder of the experiment.
        protocol: The experiment.
    """

    arm: str
    seed: int
    runs: Path
    protocol: Protocol

    @property
    def name(self) -> str:
        """For files and messages."""
        return f"{self.arm}-{self.seed}"

    block = "networks"

    @property
    def owner(self) -> str:
        """Itself: any two may be trained side by side."""
        return self.name

    @property
    def result(self) -> Path:
        """Where its counts are kept."""
        return self.runs / "trials" / f"{self.name}.json"

    @property
    def sets(self) -> list[BevSet]:
        """What it learns from."""
        return [BevSet.open(Places(self.runs).set(name)) for name in self.protocol.arms[self.arm]]

    @property
    def tests(self) -> list[str]:
        """Names of the sets it is tested on."""
        realism = self.protocol.realism
        return ["validation", *([realism.tested] if self.arm == realism.trained else [])]

    @property
    def regime(self) -> Regime:
        """How it is trained."""
        return self.protocol.regime_of(self.seed, QUICK, TWIN)

    @property
    def key(self) -> str:
        """Of everything its counts follow from."""
        names = [*self.protocol.arms[self.arm], *self.tests]
        sets = {name: BevSet.open(Places(self.runs).set(name)).digest() for name in set(names)}
        return digest([replace(self.regime, trunk=None), Path(TWIN), names, sets])

    def is_done(self) -> bool:
        """Whether its counts are there and still follow."""
        if is_current(self.result, self.key):
            return True
        self.result.unlink(missing_ok=True)
        return False


def train_and_test(trials: Sequence[Trial], workers: int, *, cuda: bool) -> list[str]:
    """Train and test; returns the names of those that failed."""
    if not cuda:
        return [each.name for each in work_off(trials, train_on_core, workers)]
    samples = held_by_arm(trials, torch.device("cuda"))
    for first in range(0, len(trials), SIDE_BY_SIDE):
        train_on_gpu(trials[first : first + SIDE_BY_SIDE], samples)
    return []


def held_by_arm(trials: Sequence[Trial], device: torch.device) -> dict[str, Held]:
    """The samples of all arms on a device."""
    return {each.arm: held(each.sets, each.regime, device) for each in {t.arm: t for t in trials}.values()}


def train_on_core(task: Task) -> None:
    """Train and test one; it goes on where it was stopped."""
    assert isinstance(task, Trial)
    student = Student(held(task.sets, task.regime, CPU), task.regime)
    key = task.key  # reads all sets
    kept, data = task.result.with_suffix(""), {"trial": key}
    student.go_on(kept, data)
    for done in student.learn():
        print(f"{task.name}: {done} of {len(student.losses)} steps", flush=True)
        student.save(kept, data)
    save(task.result, key, _counts(task, student.network))
    rmtree(kept, ignore_errors=True)


def train_on_gpu(
    trials: Sequence[Trial],
    samples: Mapping[str, Held],
    said: Callable[[int, int], None] | None = None,
) -> None:
    """Train networks together on samples of their arms, and keep the counts of each.

    Args:
        trials: At most ``SIDE_BY_SIDE``, of one protocol.
        samples: By arms.
        said: Told of steps done and all steps; without it they are printed.
    """
    students = [Student(samples[each.arm], each.regime) for each in trials]
    names, steps = ", ".join(each.name for each in trials), trials[0].protocol.regime.steps
    for done in train_together(students):
        if said is None:
            print(f"{names}: {done} of {steps} steps", flush=True)
        else:
            said(done, steps)
    for trial, student in zip(trials, students, strict=True):
        save(trial.result, trial.key, _counts(trial, student.network))


def _counts(trial: Trial, network: CrossViewTransformer) -> dict[str, Any]:
    """Cells that are right and wrong, street by street."""
    distinct = {each.folder: len(each) for each in trial.sets}
    row: dict[str, Any] = {"arm": trial.arm, "seed": trial.seed, "samples": sum(distinct.values())}
    device = network.encoder.mean.device
    row["device"] = torch.cuda.get_device_name(device) if device.type == "cuda" else "one core"
    for name in trial.tests:
        samples = Samples([BevSet.open(Places(trial.runs).set(name))])
        by_drive = score(network, samples, device=device, at_once=1 if device == CPU else 16)
        row[name] = {
            street: {what: asdict(counts) for what, counts in found.items()}
            for street, found in by_drive.items()
        }
    return row
