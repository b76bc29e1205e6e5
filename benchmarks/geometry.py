"""Which geometry is how good, and what DUSt3R's alignment costs.

    python benchmarks/geometry.py [--quick] [--resume] [--runs runs/geometry] [--only PATTERN ...]
                                  [--json FILE] [--markdown FILE] [--plot FILE.png]

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
import json
import os
import sys
from collections.abc import Sequence
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import torch
from _geometry_cases import Measurement, Row, forget, load, measure_all
from _geometry_jobs import everything
from _geometry_plot import plot
from _geometry_report import markdown
from _report_file import write

from dreamdrive.splat import set_threads


def chosen(wanted: Sequence[Measurement], patterns: Sequence[str] | None) -> list[Measurement]:
    """Those whose names match, in the order of the patterns; all without any."""
    if not patterns:
        return list(wanted)
    return list(dict.fromkeys(job for p in patterns for job in wanted if fnmatch(job.name, p)))


def report_of(wanted: Sequence[Measurement]) -> dict[str, Any]:
    """Rows of what is there, by kind; those that failed are among them."""
    rows: dict[str, list[Row]] = {}
    for job in wanted:
        if (row := load(job)) is not None:
            rows.setdefault(type(job).__name__, []).append(row)
    found = [row for each in rows.values() for row in each]
    failed = sum("failed" in row for row in found)
    return {"wanted": len(wanted), "measured": len(found) - failed, "failed": failed, "rows": rows}


def rounded(value: Any) -> Any:
    """Six digits of every number: more is noise, and makes the file long."""
    if isinstance(value, dict):
        return {key: rounded(each) for key, each in value.items()}
    if isinstance(value, list):
        return [rounded(each) for each in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def options_of(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="a little of each table")
    parser.add_argument("--resume", action="store_true", help="keep measurements that are there")
    parser.add_argument("--table-only", action="store_true", help="measure nothing, show what is there")
    parser.add_argument("--only", nargs="+", metavar="PATTERN", help="names like 'memory-*', in this order")
    parser.add_argument("--runs", type=Path, default=Path("runs/geometry"), metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="where the tables go")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="a picture of memory and seconds")
    return parser.parse_args(arguments)


def main() -> int:
    """Measure what is not there yet and print the tables."""
    options = options_of()
    torch.set_num_threads(1)
    set_threads(1)
    wanted = everything(options.runs, quick=options.quick)
    failed: list[Measurement] = []
    if not options.table_only:
        todo = chosen(wanted, options.only)
        if not options.resume:
            forget(todo)
        failed = measure_all(todo)
    report = report_of(wanted)
    text = markdown(report)
    print(text)
    write(options.json, json.dumps(rounded(report)) + "\n")
    write(options.markdown, text)
    if options.plot:
        plot(report, options.plot)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
