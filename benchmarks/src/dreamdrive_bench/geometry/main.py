"""Which geometry is how good, and what DUSt3R's alignment costs.

1. The ways of getting geometry that need no weights, on recorded clips and drawn streets of which cameras and
   depth are known.
2. DUSt3R's alignment of pointmaps that are made from drawn streets: the true points of each pair, with depth
   5 % off in patches of an eighth of the width, a scale 10 % off, a focal length 5 % off, a tenth of gross
   outliers, all drawn anew for each pair, and moving cars where they are at each frame. Beside it what the
   authors' program makes of the same pairs: its initialisation with its defects, its loss, 300 steps of Adam,
   a focal length for each image.
3. Seconds of both to the same loss.
4. Which pairs of frames are worth their time.

At last memory and seconds against the number of frames, and a recorded clip through ``dreamdrive generate``
with the true cameras and without. Seconds are those of the processor, so that they depend little on what else
the machine does: an alignment has one thread, the two of a way of getting geometry are added up. Each
measurement is a file below ``--runs`` with its date, commit and machine; with ``--resume`` those that are
there count, if they are of the same case and did not fail. How long each part takes is in the README.
"""

import argparse
import os
from collections.abc import Sequence
from fnmatch import fnmatch
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before torch is imported

import torch

from dreamdrive.splat import set_threads
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.geometry.cases import Measurement, forget, measure_all
from dreamdrive_bench.geometry.jobs import everything
from dreamdrive_bench.geometry.plot import plot
from dreamdrive_bench.geometry.report import markdown, report_of


def chosen(wanted: Sequence[Measurement], patterns: Sequence[str] | None) -> list[Measurement]:
    """Those whose names match, in the order of the patterns; all without any."""
    if not patterns:
        return list(wanted)
    return list(dict.fromkeys(job for p in patterns for job in wanted if fnmatch(job.name, p)))


def options_of() -> argparse.Namespace:
    """The command line."""
    parser = parser_of(__doc__, runs="runs/geometry", resume=True, markdown=True)
    parser.add_argument("--quick", action="store_true", help="a little of each table")
    parser.add_argument("--table-only", action="store_true", help="measure nothing, show what is there")
    parser.add_argument("--only", nargs="+", metavar="PATTERN", help="names like 'memory-*', in this order")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="a picture of memory and seconds")
    return parser.parse_args()


def main() -> int:
    """Measure what is not there yet and print the tables."""
    options = options_of()
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
