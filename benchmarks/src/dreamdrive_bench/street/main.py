"""Which representation shows a street best from where no camera has been: the paper's Table I with a truth.

Seeded worlds of 24 frames are reconstructed with five representations of motion: static (3D-GS), deformable
(all Gaussians through F_deform, as Deformable-GS and MagicDrive3D), hexplane (as S3Gaussian), vibration (as
PVG) and hybrid (ours). All take the same optimiser steps from the same points and the same static fit; a
second table gives all the seconds of hybrid, timed beside each, a third gives the others five times the
steps. Depth and motion are found by the classical geometry, with true poses, with true intrinsics alone, or
with nothing known; references are clean, or corrupted as generated video is. Every view is compared with
the clean truth. Beside them stand how consistent a rendered drive is with itself and its path, against its
references, and the same five fits of a recorded clip (``DREAMDRIVE_DATA``); at the end, what was asked of
hybrid and what it reached.

Each fit is a scene below ``--runs``, its figures a file; both know the worlds and options they follow from.
With ``--resume`` those that are there and still follow count; with ``--measure-again`` the scenes alone do,
and all figures are taken anew. ``--workers`` makes that many fits side by side, each on its share of the
cores. Seconds are the processor's, so that equal time does not depend on what else the machine does. A fit
that fails is named at the end, and its reason kept beside the others' results.
"""

import argparse
import sys
from collections.abc import Sequence
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, get_args

from dreamdrive.evaluate import Toolbox, WeightFiles, open_toolbox
from dreamdrive_bench.common.keep import is_current, kept, load, load_features
from dreamdrive_bench.common.machine import describe_machine, use_all_cores
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.workers import work_off
from dreamdrive_bench.common.worlds import SETS, set_of
from dreamdrive_bench.street.case import FRAMES, Poses, References, references_digest, world_digest
from dreamdrive_bench.street.claims import claims
from dreamdrive_bench.street.consistency import consistency_tables
from dreamdrive_bench.street.jobs import BUDGETS, Job, in_order, jobs, recorded, run
from dreamdrive_bench.street.measure import truth_features
from dreamdrive_bench.street.methods import METHODS, REPRESENTATIONS
from dreamdrive_bench.street.picture import picture
from dreamdrive_bench.street.recording import CLIP, Recorded, recording, run_recorded
from dreamdrive_bench.street.renderer import frames_a_second
from dreamdrive_bench.street.summary import summary
from dreamdrive_bench.street.tables import markdown
from dreamdrive_bench.street.views import views_digest

toolbox_of = lru_cache(maxsize=1)(open_toolbox)


def make(job: Job | Recorded, weights: WeightFiles) -> None:
    """One fit, in a worker."""
    if isinstance(job, Recorded):
        run_recorded(job)
    else:
        run(job, toolbox_of(weights))


def is_done(job: Job | Recorded, toolbox: Toolbox) -> bool:
    """Whether its figures are there, of these worlds, views, options and networks."""
    key = job.key if isinstance(job, Recorded) else job.key(toolbox)
    return is_current(job.result, key)


def clear(everything: Sequence[Job | Recorded], options: argparse.Namespace, toolbox: Toolbox) -> None:
    """Remove what does not count."""
    for job in everything:
        if not (options.resume or options.measure_again):
            job.forget()
        elif options.measure_again or not is_done(job, toolbox):
            job.result.unlink(missing_ok=True)


def draw_all(options: argparse.Namespace) -> None:
    """World by world what all keys are made from, as few worlds are held at a time."""
    for seed in options.seeds:
        for references in options.references:
            references_digest(seed, references)
        views_digest(seed)


def report_of(
    wanted: list[Job], clips: list[Recorded], toolbox: Toolbox, seeds: list[int], runs: Path
) -> dict[str, Any]:
    """Tables and a row for each fit."""
    there = [job for job in wanted if is_done(job, toolbox)]
    clips = [job for job in clips if is_done(job, toolbox)]
    records = [record for job in there if (record := load(job.result)) is not None]
    features = {(job.case, job.method, job.budget): load_features(job.result) for job in there}
    truth = {seed: truth_features(seed, runs, toolbox) for seed in seeds}
    renderer = kept(runs / "renderer.json", world_digest(seeds[0]), lambda: frames_a_second(seeds[0]))
    report = {
        "frames": FRAMES,
        "machine": describe_machine(),
        "weights": toolbox.weights,
        "missing": toolbox.missing,
        "renderer": renderer,
        "rows": records,
        "recording": [record for job in clips if (record := load(job.result)) is not None],
        "consistency": consistency_tables(records),
        **summary(records, features, truth),
    }
    return {**report, "claims": claims(report)}


def options_of(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = parser_of(__doc__, runs="runs/street", resume=True, markdown=True)
    parser.add_argument("--quick", action="store_true", help="two worlds, true poses, three representations")
    parser.add_argument("--worlds", choices=SETS, default="development", help="which set of worlds")
    parser.add_argument("--seeds", type=int, nargs="+", metavar="S", help="some worlds alone, of one set")
    parser.add_argument("--geometry", nargs="+", choices=get_args(Poses))
    parser.add_argument("--methods", nargs="+", choices=METHODS)
    parser.add_argument("--budgets", nargs="+", choices=BUDGETS)
    parser.add_argument("--references", nargs="+", choices=get_args(References))
    parser.add_argument("--no-recording", action="store_true", help="leave the recorded clip out")
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="fits side by side")
    parser.add_argument("--measure-again", action="store_true", help="keep scenes alone, measure all anew")
    parser.add_argument("--table-only", action="store_true", help="fit nothing, show what is there")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="a grid of views as PNG")
    parser.add_argument("--inception", type=Path, metavar="FILE", help="weights of FID")
    parser.add_argument("--i3d", type=Path, metavar="FILE", help="weights of FVD")
    options = parser.parse_args(arguments)
    worlds = list(SETS[options.worlds])
    options.seeds = options.seeds or (worlds[:2] if options.quick else worlds)
    try:
        set_of(options.seeds)
    except ValueError as error:
        parser.error(f"--seeds: {error}")
    options.geometry = options.geometry or (["true"] if options.quick else list(get_args(Poses)))
    options.no_recording = options.no_recording or options.quick
    options.references = options.references or list(get_args(References))
    options.methods = options.methods or list(REPRESENTATIONS[:3] if options.quick else REPRESENTATIONS)
    options.budgets = options.budgets or (["equal_steps"] if options.quick else list(BUDGETS))
    return options


def main() -> int:
    """Fit what is not there yet and print the tables."""
    options = options_of()
    weights = WeightFiles(inception=options.inception, i3d=options.i3d)
    toolbox = toolbox_of(weights)
    for figure, reason in toolbox.missing.items():
        print(f"not measured: {figure}: {reason}", file=sys.stderr)
    wanted, clips = list(jobs(options)), recorded(options)
    if recording() is None and not options.no_recording:
        print(f"not measured: {CLIP}: {DATA} has no such clip, set DREAMDRIVE_DATA", file=sys.stderr)
    everything = in_order(wanted, clips)
    draw_all(options)
    if not options.table_only:
        clear(everything, options, toolbox)
    todo = [] if options.table_only else [job for job in everything if not job.result.exists()]
    failed = work_off(todo, partial(make, weights=weights), options.workers)
    use_all_cores()
    report = report_of(wanted, clips, toolbox, options.seeds, options.runs)
    code = publish(options, report, markdown(report), [job.name for job in failed])
    if options.picture:
        picture(options.picture, options.seeds[:4], options.runs)
    return code
