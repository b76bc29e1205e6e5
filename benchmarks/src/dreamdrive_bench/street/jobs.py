"""Which fits the street benchmark makes, in which order, and one of them."""

import argparse
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from dreamdrive.evaluate import Toolbox
from dreamdrive.files.digest import digest
from dreamdrive.show import write_png
from dreamdrive_bench.common.keep import kept, save
from dreamdrive_bench.street.case import Case, Poses, References, case_digest, clip_of
from dreamdrive_bench.street.consistency import consistency_of
from dreamdrive_bench.street.fit import (
    PROBE_STEPS,
    FitTask,
    Fitted,
    Start,
    equal_time,
    fit_case,
    kept_fit,
    key_of,
    with_steps,
)
from dreamdrive_bench.street.measure import measure, networks_key, told_apart, truth_features
from dreamdrive_bench.street.methods import OURS, QUALITY, options_of
from dreamdrive_bench.street.recording import Recorded, recording
from dreamdrive_bench.street.views import views_digest

BUDGETS = ("equal_steps", "equal_time", "five_times")
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
"""Budget, poses and references of each table, the most telling first."""


@dataclass(frozen=True)
class Job(FitTask):
    """One fit, and the folder of all of them."""

    case: Case
    method: str
    budget: str
    runs: Path

    @property
    def name(self) -> str:
        """For files and messages."""
        return f"{self.case.name}-{self.method}-{self.budget}"

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
    def plan(self) -> Path:
        """Where the steps at equal time are kept, so that a fit that was interrupted takes the same."""
        return self.runs / "scenes" / f"{self.name}.plan.json"

    @property
    def has_distances(self) -> bool:
        """Whether its views count in distances between sets: these are for the main tables, and take long."""
        return self.budget == "equal_steps" and self.case.geometry != "unknown_focal"

    @property
    def fit_key(self) -> str:
        """Of everything the scene follows from: world, corruption, options, and the rule for its steps."""
        rule = [PROBE_STEPS] if self.budget == "equal_time" else [steps_of(self.budget)]
        return key_of([case_digest(self.case), self.budget, rule], options_of(self.method))

    def key(self, toolbox: Toolbox) -> str:
        """Of everything its figures follow from."""
        networks = networks_key(toolbox) if self.has_distances else []
        return digest([self.fit_key, views_digest(self.case.seed), networks])


def jobs(options: argparse.Namespace) -> Iterator[Job]:
    """All fits in the order of the plan."""
    for budget, geometry, references in PLAN:
        chosen = budget in options.budgets and references in options.references
        if not chosen or geometry not in options.geometry:
            continue
        for seed in options.seeds:
            for method in options.methods:
                if budget == "equal_steps" or method != OURS:
                    yield Job(Case(seed, geometry, references), method, budget, options.runs)


def recorded(options: argparse.Namespace) -> list[Recorded]:
    """The fits of a recording, where it is there and wanted."""
    if options.no_recording or recording() is None:
        return []
    return [Recorded(method, options.runs) for method in options.methods]


def in_order(street: list[Job], clips: list[Recorded]) -> list[Job | Recorded]:
    """The recording after the fits at equal steps."""
    first = [job for job in street if job.budget == "equal_steps"]
    return [*first, *clips, *(job for job in street if job.budget != "equal_steps")]


def steps_of(budget: str) -> int:
    """Steps of the joint fit, where they do not follow from its time."""
    base = QUALITY.fit.steps
    return base if budget == "equal_steps" else TIMES * (QUALITY.static.steps + base) - QUALITY.static.steps


def start(case: Case, runs: Path) -> Start:
    """What all fits of a case begin with."""
    return Start(runs / "cases" / case.name, case_digest(case), lambda: clip_of(case))


def fitted(job: Job) -> tuple[Fitted, dict[str, Any]]:
    """The scene, from the disk if it is there, and how its number of steps was found."""
    begin, options = start(job.case, job.runs), options_of(job.method)
    plan: dict[str, Any] = {"steps": 0 if job.budget == "equal_time" else steps_of(job.budget)}
    if job.budget == "equal_time":
        plan = kept(job.plan, job.fit_key, lambda: equal_time(begin, options))
    options = with_steps(options, plan["steps"])
    return kept_fit(job.scene, job.fit_key, lambda: fit_case(begin, options)), plan


def run(job: Job, toolbox: Toolbox, *, consistency: bool = True) -> None:
    """Fit, unless the scene is there, measure and keep; consistency takes as long as all else."""
    case = job.case
    found, plan = fitted(job)
    scene = found.scene
    extractors = toolbox.extractors if job.has_distances else []
    views, features, middle = measure(scene, case, extractors, job.runs / "truth")
    truth_features(case.seed, job.runs, toolbox)
    record = {
        "seed": case.seed,
        "geometry": case.geometry,
        "references": case.references,
        "representation": job.method,
        "budget": job.budget,
        "static_steps": QUALITY.static.steps,
        **plan,
        **asdict(found.cost),
        "gaussians": {"static": len(scene.static), "dynamic": len(scene.dynamic)},
        "views": views,
        **told_apart(scene, case.seed),
    }
    if consistency and job.method == OURS and case.references == "corrupted":
        record["consistency"] = consistency_of(scene, case, job.runs)
    write_png(job.runs / "shown" / f"{job.name}.png", middle)
    save(job.result, job.key(toolbox), record, features)
