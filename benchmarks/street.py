"""Which representation shows a street best from where no camera has been: the paper's Table I with a truth.

    python benchmarks/street.py [--quick] [--seeds S ...] [--resume] [--runs runs/street] [--json FILE]
                                [--markdown FILE] [--picture FILE] [--inception FILE] [--i3d FILE]

Seeded worlds of 24 frames are reconstructed with five representations of motion: static (3D-GS), deformable
(all Gaussians through F_deform, as Deformable-GS and MagicDrive3D), hexplane (as S3Gaussian), vibration (as
PVG) and hybrid (ours). All take the same optimiser steps from the same points and the same static fit; a
second table gives all the seconds of hybrid, a third gives the others five times the steps. Depth and motion
are found by the classical geometry, with true poses, with true intrinsics alone, or with nothing known;
references are clean, or corrupted as generated video is. Every view is compared with the clean truth.

Each fit is a file below ``--runs``; with ``--resume`` those that are there count.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from _street_case import FRAMES, NOVEL, VIEWS, Case, Poses, References, start, true_frames
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
from _street_table import markdown, picture, summary

from dreamdrive.cli.machine import use_all_cores
from dreamdrive.evaluate.extractors import Toolbox, WeightFiles, open_toolbox
from dreamdrive.fit import Representation
from dreamdrive.options import QUALITIES
from dreamdrive.splat import native_info

SEEDS = tuple(range(8))
REPRESENTATIONS: tuple[Representation, ...] = ("hybrid", "static", "vibration", "deformable", "hexplane")
BUDGETS = ("equal_steps", "equal_time", "five_times")
QUALITY = QUALITIES["draft"]
TIMES = 5


@dataclass(frozen=True)
class Job:
    """One fit."""

    case: Case
    representation: Representation
    budget: str

    def path(self, runs: Path) -> Path:
        """Where its result is kept."""
        return runs / "fits" / f"{self.case.name}-{self.representation}-{self.budget}.json"


def jobs(options: argparse.Namespace) -> Iterator[Job]:
    """All fits, the most telling first."""
    for budget in options.budgets:
        for references in get_args(References):
            for geometry in options.geometry:
                if geometry == "unknown_focal" and budget != "equal_steps":
                    continue
                for seed in options.seeds:
                    for representation in options.representations:
                        if not (budget != "equal_steps" and representation == "hybrid"):
                            yield Job(Case(seed, geometry, references), representation, budget)


def steps_of(job: Job, runs: Path) -> int | None:
    """Steps of the joint fit; None if what they follow from is not there."""
    base = QUALITY.fit.steps
    if job.budget == "equal_steps":
        return base
    if job.budget == "five_times":
        return TIMES * (QUALITY.static.steps + base) - QUALITY.static.steps
    ours = load(Job(job.case, "hybrid", "equal_steps").path(runs))
    theirs = load(Job(job.case, job.representation, "equal_steps").path(runs))
    if ours is None or theirs is None:
        return None
    return max(1, round(ours["seconds"] / theirs["step_s"]))


def run(job: Job, runs: Path, toolbox: Toolbox) -> None:
    """Fit, measure and keep."""
    steps = steps_of(job, runs)
    if steps is None:
        return
    begin = start(job.case, QUALITY, runs / "cases")
    fitted = fit_case(begin, job.representation, with_steps(QUALITY, steps), lambda *_: None)
    views, features, middle = measure(fitted, job.case, toolbox.extractors, runs / "truth")
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
        "gaussians": {"static": len(fitted.scene.static), "dynamic": len(fitted.scene.dynamic)},
        "views": views,
        **told_apart(fitted, job.case),
    }
    keep_picture(runs / "shown" / f"{job.path(runs).stem}.png", middle)
    save(job.path(runs), record, features)


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


def options_of(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="two worlds, true poses, three representations")
    parser.add_argument("--seeds", type=int, nargs="+", metavar="S")
    parser.add_argument("--geometry", nargs="+", choices=get_args(Poses))
    parser.add_argument("--representations", nargs="+", choices=REPRESENTATIONS)
    parser.add_argument("--budgets", nargs="+", choices=BUDGETS)
    parser.add_argument("--resume", action="store_true", help="keep fits that are finished")
    parser.add_argument("--table-only", action="store_true", help="fit nothing, show what is there")
    parser.add_argument("--runs", type=Path, default=Path("runs/street"), metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--markdown", type=Path, metavar="FILE")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="a grid of views as PNG")
    parser.add_argument("--inception", type=Path, metavar="FILE", help="weights of FID")
    parser.add_argument("--i3d", type=Path, metavar="FILE", help="weights of FVD")
    options = parser.parse_args(arguments)
    options.seeds = options.seeds or (list(SEEDS[:2]) if options.quick else list(SEEDS))
    options.geometry = options.geometry or (["true"] if options.quick else list(get_args(Poses)))
    options.representations = options.representations or list(
        REPRESENTATIONS[:3] if options.quick else REPRESENTATIONS
    )
    options.budgets = options.budgets or (["equal_steps"] if options.quick else list(BUDGETS))
    return options


def main() -> None:
    """Fit what is not there yet and print the tables."""
    use_all_cores()
    options = options_of()
    toolbox = open_toolbox(WeightFiles(inception=options.inception, i3d=options.i3d))
    for figure, reason in toolbox.missing.items():
        print(f"not measured: {figure}: {reason}", file=sys.stderr)
    wanted = list(jobs(options))
    if not options.resume and not options.table_only:
        for job in wanted:
            job.path(options.runs).unlink(missing_ok=True)
    todo = [] if options.table_only else [job for job in wanted if not job.path(options.runs).exists()]
    began = time.perf_counter()
    for number, job in enumerate(todo):
        run(job, options.runs, toolbox)
        spent = time.perf_counter() - began
        left_min = spent / (number + 1) * (len(todo) - number - 1) / 60
        name = f"{job.case.name} {job.representation} {job.budget}"
        print(f"{number + 1}/{len(todo)} {name}: about {left_min:.0f} min left", file=sys.stderr, flush=True)
    records = [record for job in wanted if (record := load(job.path(options.runs))) is not None]
    features = {}
    for job in wanted:
        if job.path(options.runs).exists():
            features[job.case, job.representation, job.budget] = load_features(job.path(options.runs))
    truth = {seed: truth_features(seed, options.runs, toolbox) for seed in options.seeds}
    report: dict[str, Any] = {
        "frames": FRAMES,
        "machine": native_info(),
        "weights": toolbox.weights,
        "missing": toolbox.missing,
        "rows": [
            {
                **{key: value for key, value in record.items() if key != "views"},
                "view": view,
                **record["views"][view],
            }
            for record in records
            for view in VIEWS
        ],
        **summary(records, features, truth),
    }
    text = markdown(report)
    print(text)
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n")
    if options.markdown:
        options.markdown.write_text(text)
    if options.picture:
        picture(options.picture, options.seeds[:4], options.runs)


if __name__ == "__main__":
    main()
