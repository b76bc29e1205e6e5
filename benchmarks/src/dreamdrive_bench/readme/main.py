"""All figures of the README, and how far they hold on worlds that no choice was made on.

Drawn streets first: the worlds kept for tests, with five representations from clean references and hybrid
from corrupted ones, and hybrid on the worlds of the development; intrinsics are known, poses are not. Then
the recorded clips, each through ``dreamdrive generate``; choices were made on all of them, and the tables
call them development clips. ``--whole-paper`` adds methods at the size that their authors give them, on four
test worlds with true poses and equal steps.

The tables replace the sections of ``README.md`` and ``docs/figures.md`` that bear their names, and all rows
go to ``benchmarks/results/readme-DATE.json`` with commit and machine. What is finished is kept below
``--runs``, in a folder a commit, and the same command goes on from there: a long run belongs into a pinned
checkout, see ``pinned``. ``--quick`` takes two worlds and one clip, and only prints.
"""

import argparse
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dreamdrive.evaluate import Toolbox
from dreamdrive.files.digest import digest
from dreamdrive.run import program_digest
from dreamdrive_bench import clips
from dreamdrive_bench.common.keep import is_current, kept, load
from dreamdrive_bench.common.machine import COMMIT, describe_machine, use_all_cores
from dreamdrive_bench.common.markdown import replace_section
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import as_json, exit_code, write
from dreamdrive_bench.common.workers import work_off
from dreamdrive_bench.common.worlds import DEVELOPMENT, TEST
from dreamdrive_bench.readme.tables import MAIN_CLIP, OTHER_CLIPS, sections
from dreamdrive_bench.street.case import Case, Poses, References
from dreamdrive_bench.street.jobs import Job, run
from dreamdrive_bench.street.methods import FULL_SIZE, OURS, REPRESENTATIONS

README, FIGURES, RESULTS = Path("README.md"), Path("docs/figures.md"), Path("benchmarks/results")
PAPER_WORLDS = TEST[:4]


def options_of(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = parser_of(__doc__, runs="runs/readme")
    parser.add_argument("--quick", action="store_true", help="two worlds and one clip; nothing is written")
    parser.add_argument("--whole-paper", action="store_true", help="methods at the size of their papers too")
    parser.add_argument("--no-clips", action="store_true", help="drawn streets alone; nothing is written")
    parser.add_argument("--workers", type=int, default=2, metavar="N", help="fits side by side")
    options = parser.parse_args(arguments)
    options.runs = options.runs / COMMIT
    return options


def jobs_of(options: argparse.Namespace) -> list[Job]:
    """All fits of drawn streets, world by world."""
    test, development = (TEST[:1], DEVELOPMENT[:1]) if options.quick else (TEST, DEVELOPMENT)
    methods = REPRESENTATIONS[:2] if options.quick else REPRESENTATIONS
    found = [_job(options, seed, method) for seed in test for method in methods]
    found += [_job(options, seed, OURS) for seed in development]
    if not options.quick:
        found += [_job(options, seed, OURS, references="corrupted") for seed in (*test, *development)]
    if options.whole_paper:
        worlds = PAPER_WORLDS[:1] if options.quick else PAPER_WORLDS
        found += [_job(options, seed, method, "true") for seed in worlds for method in (OURS, *FULL_SIZE)]
    return found


def _job(
    options: argparse.Namespace,
    seed: int,
    method: str,
    geometry: Poses = "estimated",
    references: References = "clean",
) -> Job:
    return Job(Case(seed, geometry, references), method, "equal_steps", options.runs)


def make(job: Job) -> None:
    """One fit, in a worker; without the figures that networks and structure from motion find in its views."""
    run(job, Toolbox(), consistency=False)


def drawn(options: argparse.Namespace) -> tuple[list[dict[str, Any]], list[str]]:
    """A row for each fit of a drawn street, and the names of those that failed."""
    jobs = jobs_of(options)
    for job in jobs:
        if not is_current(job.result, job.key(Toolbox())):
            job.result.unlink(missing_ok=True)
    failed = work_off([job for job in jobs if not job.result.exists()], make, options.workers)
    use_all_cores()
    rows = [row for job in jobs if (row := load(job.result)) is not None]
    return rows, [job.name for job in failed]


def recorded(options: argparse.Namespace) -> tuple[list[dict[str, Any]], list[str]]:
    """A row for each run of a recorded clip, and the names of those that failed."""
    names = [] if options.no_clips else ["pandaset-draft"] if options.quick else [*MAIN_CLIP, *OTHER_CLIPS]
    rows: list[dict[str, Any]] = []
    failed: list[str] = []
    for name in names:
        try:
            rows.append(_clip(name, options.runs / "clips"))
        except (subprocess.CalledProcessError, OSError, ValueError) as error:
            failed.append(name)
            print(f"{name}: {error}", file=sys.stderr, flush=True)
    return rows, failed


def _clip(name: str, runs: Path) -> dict[str, Any]:
    """One run, which goes on from where it was; its folder is of this program and these options alone."""
    key = digest([asdict(clips.RUNS[name]), program_digest()])
    out = runs / f"{name}-{key[:12]}"
    return kept(runs / f"{name}.json", key, lambda: clips.measure(name, clips.RUNS[name], out))


def put(texts: dict[str, str], into: Path) -> None:
    """Each section into the page that has its marks."""
    for page in (into / README, into / FIGURES):
        for name in [name for name in texts if f"<!-- {name}: begin -->" in page.read_text()]:
            replace_section(page, name, texts[name])


def main(into: Path = Path()) -> int:
    """Measure what is not there yet, print the tables, and write them where all of them are whole."""
    options = options_of()
    streets, lost = drawn(options)
    rows, failed = recorded(options)
    report = {"machine": describe_machine(), "streets": streets, "clips": rows}
    texts = sections(report)
    print("\n\n".join(f"{name}\n\n{text}" for name, text in texts.items()))
    write(options.json, as_json(report))
    return finish(options, report, texts, [*lost, *failed], into)


def finish(
    options: argparse.Namespace,
    report: dict[str, Any],
    texts: dict[str, str],
    failed: Iterable[str],
    into: Path,
) -> int:
    """Write report and pages of a whole run; the exit code."""
    code = exit_code(failed)
    if code == 0 and not (options.quick or options.no_clips):
        write(into / RESULTS / f"readme-{report['machine']['date']}.json", as_json(report))
        put(texts, into)
    return code
