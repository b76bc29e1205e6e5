"""The street network: outlined pictures and textures are carried, streets are drawn where it is trained.

A drawn picture with its truth takes 70 KB and a second of a core: sixteen cores draw in two minutes what
would not fit into a pack. No street of those is one that the twin has seen, and what is judged by is kept out
of both.
"""

import json
import time
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import torch

from dreamdrive.compute.machine import available_cores
from dreamdrive.files.output import scratch_beside
from dreamdrive_bench.common.places import DATA, ROOT
from dreamdrive_bench.common.twin import TWIN
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.training.limit import SAVING_S, Limit, Pace, steps_that_fit
from dreamdrive_bench.training.packed import MOST_BYTES, save_pack, unpack, with_packages
from dreamdrive_train.street_network import (
    LOG,
    WEIGHTS,
    DrawnOptions,
    LoaderOptions,
    StreetTraining,
    TrainingOptions,
    draw_records,
    judge_weights,
    labelled_records,
    make_textures,
    read_records,
    train_street,
    write_records,
)

SOURCES = (
    "comma10k",
    "global_streetscapes_a",
    "global_streetscapes_b",
    "opensfm",
    "osv5m",
    "sully_chen",
    "zod",
)
"""Files of outlines whose pictures the twin has learned from."""
FIRST_SEED = 1_100_000
"""Of the streets that are drawn: beyond those that the twin has seen."""
JUDGED = range(8)
"""Streets of the development; the test's are left alone."""
_DRAWN_SHARE = 2.0
"""How often drawn pictures are taken against all real ones."""
_DRAWING = 0.4
"""Share of the time after which no more streets are drawn."""
_JUDGEMENTS = 4


@dataclass(frozen=True)
class Drawn:
    """Folders of drawn records, to learn from and to judge by."""

    learned: Path
    judged: Path


@dataclass(frozen=True)
class StreetPlan:
    """What is trained, where it has room to choose.

    Attributes:
        streets: Drawn to learn from, twelve pictures each; fewer where two fifths of the time are spent.
        judged: Drawn to judge by.
        steps: Of the training; None takes as many as fit into what is left.
        tried: Steps of a training that is thrown away, to find how many fit; half of them count.
        init: Weights to start from.
        drawn: How streets are seen.
        options: Of the training; its steps and judgements follow from the above.
    """

    streets: int = 192
    judged: range = JUDGED
    steps: int | None = None
    tried: int = 160
    init: Path = Path(TWIN)
    drawn: DrawnOptions = field(default_factory=DrawnOptions)
    options: TrainingOptions = field(
        default_factory=lambda: TrainingOptions(
            rate=1e-3,
            checkpoint_s=60.0,
            loader=LoaderOptions(batch=16, workers=max(1, available_cores() - 2)),
        )
    )


def make_pack(path: Path, most_bytes: int = MOST_BYTES, wheels: Path | None = None) -> tuple[int, int | None]:
    """Write the pack; its bytes, and the quality of WebP."""
    pictures = DATA / "training"
    with scratch_beside(path) as made:
        records = [
            record
            for name in SOURCES
            for record in labelled_records(ROOT / f"training/labels/{name}.json", pictures, made / "real")
        ]
        write_records(records, made / "real")
        make_textures(ROOT / "training/texture_cuts.json", pictures, made / "textures")
        folders = {name: made / name for name in ("real", "textures")}
        return save_pack(path, folders | with_packages(wheels, made), {"of": "street"}, most_bytes)


def train(
    pack: Path, out: Path, device: torch.device, limit: Limit, figures: Figures, plan: StreetPlan
) -> bool:
    """Train from a pack within a limit, or go on; whether all steps were taken.

    ``out/network`` gets the weights with each checkpoint, once a minute and where time is over.
    """
    unpack(pack, out / "records")
    going_on = (out / "network/checkpoint.json").is_file()
    drawn = _drawn(out / "records", limit, figures, plan, going_on=going_on)
    training = _training(out, drawn, plan)
    figures.put("start", _judged(plan.init, training, drawn, device))
    figures.put("begin_s", limit.spent_s)
    steps = _steps(training, device, limit, plan)
    options = replace(plan.options, steps=steps, validate_each=max(1, steps // _JUDGEMENTS))
    pace = Pace(figures, "training", lambda: _last(training.out / LOG))
    found = train_street(
        replace(training, options=options),
        device=device,
        stop=lambda: limit.left_s < SAVING_S,
        progress=pace,
    )
    if found is None:
        figures.put("stopped", "time was over; the same command goes on where its folder is")
    figures.put("end", _judged(training.out / WEIGHTS, training, drawn, device))
    return found is not None


def _judged(
    weights: Path, training: StreetTraining, drawn: Drawn, device: torch.device
) -> dict[str, dict[str, float]]:
    """Figures of weights on the real pictures that are kept out, and on drawn ones."""
    return {
        "real": judge_weights(weights, training.data, (), device),
        "drawn": judge_weights(weights, (), (drawn.judged,), device),
    }


def _drawn(folder: Path, limit: Limit, figures: Figures, plan: StreetPlan, *, going_on: bool) -> Drawn:
    """Draw records; those that are there are kept, and a training that goes on has those that it had."""
    drawn = Drawn(folder / "drawn", folder / "drawn-judged")
    if going_on:
        return drawn
    cores, begin = available_cores(), time.monotonic()
    textures = folder / "textures" if (folder / "textures").is_dir() else None
    how: dict[str, Any] = {"options": plan.drawn, "textures": textures, "processes": cores}
    draw_records(plan.judged, drawn.judged, **how)
    every, done = range(FIRST_SEED, FIRST_SEED + plan.streets), 0
    while done < len(every) and (not done or limit.spent_s < _DRAWING * limit.seconds):
        done = min(len(every), done + 4 * cores)
        draw_records(every[:done], drawn.learned, **how)
        told = {"streets": done, "of": len(every), "cores": cores, "seconds": time.monotonic() - begin}
        figures.put("drawn", told)
    return drawn


def _training(out: Path, drawn: Drawn, plan: StreetPlan) -> StreetTraining:
    """All but the number of steps; real sources are taken as often as they have pictures."""
    real = out / "records/real"
    counts = Counter(record.source for record in read_records(real) if not record.kept_out)
    mix = {source: count / counts.total() for source, count in sorted(counts.items())}
    return StreetTraining(
        data=(real, drawn.learned),
        out=out / "network",
        options=plan.options,
        mix=mix | {"drawn": _DRAWN_SHARE},
        init=plan.init,
        licence="CC-BY-SA-4.0",
    )


def _steps(training: StreetTraining, device: torch.device, limit: Limit, plan: StreetPlan) -> int:
    """As many steps as are asked for, as a training that was stopped had, or as fit into the time."""
    checkpoint = training.out / "checkpoint.json"
    if checkpoint.is_file():
        return int(json.loads(checkpoint.read_text())["options"]["steps"])
    if plan.steps is not None:
        return plan.steps
    times = list[float]()

    def stop() -> bool:
        return len(times) >= plan.tried - 1  # before its end nothing is judged

    def note(done: int, total: int) -> None:
        times.append(time.monotonic())

    with scratch_beside(training.out) as thrown:
        options = replace(plan.options, steps=plan.tried, validate_each=plan.tried)
        tried = replace(training, out=thrown / "network", options=options)
        train_street(tried, device=device, stop=stop, progress=note)
    return steps_that_fit(times, limit)


def _last(log: Path) -> dict[str, Any]:
    """The last losses and all judgements of a training."""
    lines = [json.loads(line) for line in log.read_text().splitlines()] if log.is_file() else []
    losses = [line for line in lines if "figures" not in line]
    judged = {str(line["step"]): line["figures"] for line in lines if "figures" in line}
    return {"losses": losses[-1] if losses else None, "judged": judged}
