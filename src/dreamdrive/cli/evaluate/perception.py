"""``dreamdrive evaluate perception``: what generated samples are worth to a network that sees from above."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import OmitArgPrefixes, UseAppendAction, arg

from dreamdrive.cli.terminal.arguments import DeviceFlag
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import asked_to_stop, use_all_cores
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.cli.terminal.tables import check_files, fixed, print_table, write_json
from dreamdrive.errors import InputError
from dreamdrive.files.given import check_there

if TYPE_CHECKING:
    import torch

    from dreamdrive.tasks.perception import Experiment, Regime

_MODES = {
    "augment": "real and synthetic samples together, as many steps, tested on real ones",
    "realism": "trained on real samples, tested on synthetic ones",
    "synthetic-train": "synthetic samples alone, tested on real ones",
}


@dataclass(frozen=True)
class TrainingFlags:
    """The network, and how it is trained.

    Attributes:
        network: published is that of the publication, for pictures of 480x224 and 200 cells; small the same
            for 208x96 and 104 cells; quick is small on the street network's trunk.
        classes: What one network segments; the publication trains one network for each.
        trunk: Weights that the trunk starts from: a file of EfficientNet-B4, or for quick street.
        steps: Steps of each training.
        batch: Samples a step.
        rate: Largest step of the optimiser.
        alpha: Weight of cells with a vehicle, all others weigh 1 - alpha; without it both weigh the same, as
            published, and short trainings call hardly any cell a vehicle. 0.75 mends that.
        seed: Seed of first weights and of the order of samples.
    """

    network: Literal["published", "small", "quick"] = "published"
    classes: Literal["both", "vehicle", "road"] = "both"
    trunk: Annotated[str | None, arg(metavar="street|FILE", help_behavior_hint="")] = None
    steps: Annotated[int, arg(metavar="N")] = 30_001
    batch: Annotated[int, arg(metavar="N")] = 16
    rate: Annotated[float, arg(metavar="F")] = 4e-3
    alpha: Annotated[float | None, arg(metavar="F", help_behavior_hint="")] = None
    seed: Annotated[int, arg(metavar="S")] = 0

    def check(self) -> None:
        """Raise ``InputError`` for a number that no training has."""
        if min(self.steps, self.batch) < 1 or self.seed < 0 or not 0 < self.rate < 1:
            raise InputError(
                f"--steps {self.steps} --batch {self.batch} --seed {self.seed} --rate {self.rate:g}: "
                "expected at least one step and sample, a seed of 0 or more and a rate between 0 and 1"
            )
        if self.alpha is not None and not 0 < self.alpha < 1:
            raise InputError(f"--alpha {self.alpha:g}: expected a number between 0 and 1")


def perception(
    *,
    mode: Literal["augment", "realism", "synthetic-train"],
    real: Annotated[UseAppendAction[tuple[Path, ...]], arg(metavar="SET")] = (),
    synthetic: Annotated[UseAppendAction[tuple[Path, ...]], arg(metavar="SET")] = (),
    validation: Annotated[UseAppendAction[tuple[Path, ...]], arg(metavar="SET")] = (),
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    training: OmitArgPrefixes[TrainingFlags] = TrainingFlags(),
    device: DeviceFlag = "cpu",
    json: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
) -> None:
    """Train Cross-View Transformers on sets of samples and compare what they see.

    Args:
        mode: augment adds the synthetic samples to the real ones; realism tests on synthetic ones a network
            that was trained on real ones; synthetic-train trains on synthetic ones alone.
        real: A set of recorded samples to train on, see dreamdrive dataset make; may be given more than once.
        synthetic: A set of samples of scenes; may be given more than once.
        validation: A set of recorded samples that nothing is trained on; may be given more than once.
        out: Folder for the networks; the same command goes on from there.
        training: The network, and how it is trained.
        device: Where networks are trained.
        json: Write the figures to this file as well.
    """
    check_files(json=json)
    training.check()
    if missing := [
        flag
        for flag, given in (("--real", real), ("--synthetic", synthetic), ("--validation", validation))
        if not given
    ]:
        raise InputError(f"{' and '.join(missing)}: expected a set of samples, see dreamdrive dataset make")
    for path in (*real, *synthetic, *validation):
        check_there(path, "a set of samples, see dreamdrive dataset make")
    use_all_cores()
    from dreamdrive.compute.device import computing_on
    from dreamdrive.tasks.perception import BevSet, read_trials

    reals, made, tests = ([BevSet.open(path) for path in paths] for paths in (real, synthetic, validation))
    console = plain()
    with computing_on(device) as where, asked_to_stop() as stop, Bars(console) as bars:
        regime = _regime(where, training)
        trials = read_trials(mode, reals, made, tests, out, regime, device=where, stop=stop, progress=bars)
        if trials is None:
            stop.end()
            return
    columns = ("trained on", "tested on", "vehicle", "all vehicles", "road")
    print_table(console, f"{mode}: {_MODES[mode]}; IoU in %", columns, [_row(trial) for trial in trials])
    if json is not None:
        write_json(json, {"mode": mode, "regime": asdict(regime), "trials": [_figures(t) for t in trials]})


def _regime(device: "torch.device", flags: TrainingFlags) -> "Regime":
    from dreamdrive.compute.device import has_bfloat16
    from dreamdrive.tasks.perception import (
        QUICK,
        SMALL,
        CvtOptions,
        CvtTraining,
        LossOptions,
        Regime,
        ScheduleOptions,
    )

    sizes = {"published": CvtOptions(), "small": SMALL, "quick": QUICK}[flags.network]
    wanted: Any = ("vehicle", "road") if flags.classes == "both" else (flags.classes,)
    training = CvtTraining(
        schedule=ScheduleOptions(steps=flags.steps, rate=flags.rate),
        losses=LossOptions() if flags.alpha is None else LossOptions(alpha=flags.alpha),
        low_precision=has_bfloat16(device),
        frozen_layers=2 if flags.network == "quick" and flags.trunk else 0,
        seed=flags.seed,
    )
    return Regime(replace(sizes, classes=wanted), training, flags.batch, flags.trunk)


def _row(trial: "Experiment") -> tuple[str, ...]:
    iou = _figures(trial)["iou"]
    return (trial.trained_on, trial.tested_on, *(fixed(iou.get(k), 2, 100) for k in _COLUMNS))


_COLUMNS = ("vehicle", "vehicle_all", "road")


def _figures(trial: "Experiment") -> dict[str, Any]:
    """IoU at a probability of one half, and the counts of each drive."""
    from dreamdrive.tasks.perception import pooled

    return {
        "trained_on": trial.trained_on,
        "tested_on": trial.tested_on,
        "iou": {name: counts.iou()[0.5] for name, counts in pooled(trial.by_drive).items()},
        "by_drive": {
            drive: {name: asdict(counts) for name, counts in found.items()}
            for drive, found in trial.by_drive.items()
        },
    }
