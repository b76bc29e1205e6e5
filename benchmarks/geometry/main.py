"""The command line of ``geometry.py``."""

import argparse
from collections.abc import Sequence
from fnmatch import fnmatch
from pathlib import Path

import torch

from common.options import parser_of
from common.report import publish
from dreamdrive.splat import set_threads
from geometry.cases import Measurement, forget, measure_all
from geometry.jobs import everything
from geometry.plot import plot
from geometry.report import markdown, report_of


def chosen(wanted: Sequence[Measurement], patterns: Sequence[str] | None) -> list[Measurement]:
    """Those whose names match, in the order of the patterns; all without any."""
    if not patterns:
        return list(wanted)
    return list(dict.fromkeys(job for p in patterns for job in wanted if fnmatch(job.name, p)))


def options_of(doc: str | None) -> argparse.Namespace:
    """The command line."""
    parser = parser_of(doc, runs="runs/geometry", resume=True, markdown=True)
    parser.add_argument("--quick", action="store_true", help="a little of each table")
    parser.add_argument("--table-only", action="store_true", help="measure nothing, show what is there")
    parser.add_argument("--only", nargs="+", metavar="PATTERN", help="names like 'memory-*', in this order")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="a picture of memory and seconds")
    return parser.parse_args()


def main(doc: str | None) -> int:
    """Measure what is not there yet and print the tables."""
    options = options_of(doc)
    torch.set_num_threads(1)
    set_threads(1)
    wanted = everything(quick=options.quick)
    failed: list[Measurement] = []
    if not options.table_only:
        todo = chosen(wanted, options.only)
        if not options.resume:
            forget(todo, options.runs)
        failed = measure_all(todo, options.runs)
    report = report_of(wanted, options.runs)
    code = publish(options, report, markdown(report), [job.name for job in failed])
    if options.plot:
        plot(report, options.plot)
    return code
