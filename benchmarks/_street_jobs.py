"""Which fits the street benchmark makes, in which order, and one of them."""

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from _street_case import NOVEL, Case, Poses, References, start, true_frames
from _street_consistency import consistency_of
from _street_fit import (
    Features,
    features_of,
    fit_case,
    keep_picture,
    load,
    load_features,
    measure,
    save,
    told_apart,
    with_steps,
)
from _street_recording import Recorded, recording
from _workers import threads

from dreamdrive.evaluate.extractors import Toolbox
from dreamdrive.fit import Representation
from dreamdrive.options import QUALITIES

SEEDS = tuple(range(8))
REPRESENTATIONS: tuple[Representation, ...] = ("hybrid", "static", "vibration", "deformable", "hexplane")
BUDGETS = ("equal_steps", "equal_time", "five_times")
QUALITY = QUALITIES["draft"]
TIMES = 5

PLAN: tuple[tuple[str, Poses, References], ...] = (
    ("equal_steps", "true", "corrupted"),
    ("equal_steps", "true", "clean"),
    ("equal_steps", "estimated", "corrupted"),
    ("equal_steps", "estimated", "clean"),
    ("equal_steps", "unknown_focal", "corrupted"),
    ("equal_time", "true", "corrupted"),
    ("equal_time", "true", "clean"),
    ("five_times", "true", "corrupted"),
)
"""Budget, poses and references of each table, the most telling first; equal time follows from equal steps."""


@dataclass(frozen=True)
class Job:
    """One fit, and the folder of all of them."""

    case: Case
    representation: Representation
    budget: str
    runs: Path

    @property
    def name(self) -> str:
        """For files and messages."""
        return f"{self.case.name}-{self.representation}-{self.budget}"

    @property
    def block(self) -> str:
        """Its table."""
        return f"{self.budget}-{self.case.geometry}-{self.case.references}"

    @property
    def owner(self) -> str:
        """Its world: what is drawn and prepared of one is never made by two processes at once."""
        return str(self.case.seed)

    @property
    def result(self) -> Path:
        """Where its figures are kept."""
        return self.runs / "fits" / f"{self.name}.json"

    @property
    def has_distances(self) -> bool:
        """Whether its views count in distances between sets: these are for the main tables, and take long."""
        return self.budget == "equal_steps" and self.case.geometry != "unknown_focal"

    def with_equal_steps(self, representation: Representation) -> "Job":
        """The fit of the same case by steps."""
        return Job(self.case, representation, "equal_steps", self.runs)


def jobs(options: argparse.Namespace) -> Iterator[Job]:
    """All fits in the order of the plan."""
    for budget, geometry, references in PLAN:
        chosen = budget in options.budgets and references in options.references
        if not chosen or geometry not in options.geometry:
            continue
        for seed in options.seeds:
            for representation in options.representations:
                if budget == "equal_steps" or representation != "hybrid":
                    yield Job(Case(seed, geometry, references), representation, budget, options.runs)


def recorded(options: argparse.Namespace) -> list[Recorded]:
    """The fits of a recording, where it is there and wanted."""
    if options.no_recording or recording() is None:
        return []
    return [Recorded(representation, options.runs) for representation in options.representations]


def in_order(street: list[Job], clips: list[Recorded]) -> list[Job | Recorded]:
    """The recording after the fits at equal steps."""
    first = [job for job in street if job.budget == "equal_steps"]
    return [*first, *clips, *(job for job in street if job.budget != "equal_steps")]


def steps_of(job: Job) -> int:
    """Steps of the joint fit."""
    base = QUALITY.fit.steps
    if job.budget == "equal_steps":
        return base
    if job.budget == "five_times":
        return TIMES * (QUALITY.static.steps + base) - QUALITY.static.steps
    ours = load(job.with_equal_steps("hybrid").result)
    theirs = load(job.with_equal_steps(job.representation).result)
    if ours is None or theirs is None:
        raise FileNotFoundError(f"{job.name}: steps at equal time follow from both fits at equal steps")
    if ours["threads"] != theirs["threads"]:
        raise ValueError(f"{job.name}: its fits at equal steps were timed on different numbers of threads")
    return max(1, round(ours["seconds"] / theirs["step_s"]))


def run(job: Job, toolbox: Toolbox) -> None:
    """Fit, measure and keep."""
    steps = steps_of(job)
    begin = start(job.case, QUALITY, job.runs / "cases")
    fitted = fit_case(begin, job.representation, with_steps(QUALITY, steps), lambda *_: None)
    extractors = toolbox.extractors if job.has_distances else []
    views, features, middle = measure(fitted, job.case, extractors, job.runs / "truth")
    truth_features(job.case.seed, job.runs, toolbox)
    record = {
        "seed": job.case.seed,
        "geometry": job.case.geometry,
        "references": job.case.references,
        "representation": job.representation,
        "budget": job.budget,
        "static_steps": QUALITY.static.steps,
        "steps": steps,
        "seconds": fitted.seconds,
        "step_s": fitted.step_s,
        "threads": threads(),
        "gaussians": {"static": len(fitted.scene.static), "dynamic": len(fitted.scene.dynamic)},
        "views": views,
        **told_apart(fitted, job.case),
    }
    if job.representation == "hybrid" and job.case.references == "corrupted":
        record["consistency"] = consistency_of(fitted.scene, job.case, job.runs)
    keep_picture(job.runs / "shown" / f"{job.name}.png", middle)
    save(job.result, record, features)


def truth_features(seed: int, runs: Path, toolbox: Toolbox) -> Features:
    """Features of the true novel views of a world, kept."""
    path = runs / "truth" / f"features-{seed}.json"
    wanted = {extractor.frechet for extractor in toolbox.extractors}
    if path.exists() and set(json.loads(path.read_text())["networks"]) == wanted:
        return load_features(path)
    found: Features = {}
    for view in NOVEL:
        rows = features_of(true_frames(seed, view, runs / "truth"), toolbox.extractors)
        found |= {f"{name}/{view}": values for name, values in rows.items()}
    save(path, {"networks": sorted(wanted)}, found)
    return found
