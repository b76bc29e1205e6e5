"""Cuts in recordings: how many are found, at the right frame, and how often one is seen where none is.

The recordings are made from the drives and photos in ``DREAMDRIVE_DATA`` (default ``../shared/data``) and
from drawn worlds, clean and as a video model might have drawn them. A cut counts as found if it is named at
its very frame; whatever else is named is a false alarm.
"""

import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain, islice
from pathlib import Path

import cv2
import numpy as np

from dreamdrive.data.frames.cuts import find_cuts
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.places import DREAMDRIVE
from dreamdrive_bench.common.report import as_json, write
from dreamdrive_bench.cuts.cases import (
    Case,
    apart,
    at_the_ends,
    disturbed,
    drives,
    joined,
    left_out,
    photo_drives,
    photos,
    quiet,
    read,
    softened,
)

SEEDS = range(8)
WORLD = ["--frames", "40", "--one-ray", "--size", "320x180"]


@dataclass
class Row:
    """Sums over the recordings of a group."""

    recordings: int = 0
    cuts: int = 0
    found: int = 0
    false_alarms: int = 0
    frames: int = 0
    seconds: float = 0.0
    wrong: list[str] = field(default_factory=list)


def main() -> int:
    """Measure, print each group and write all as JSON."""
    parser = parser_of(__doc__)
    parser.add_argument("--worlds", type=Path, default=Path("runs/cut_worlds"), metavar="DIR")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="take every Nth recording only")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    rows: dict[str, Row] = {}
    for case in islice(cases(args.worlds), 0, None, args.every):
        measure(case, rows)
        report = {"every": args.every, "groups": summary(rows)}
        write(args.json, as_json(report))
    for group, row in rows.items():
        print(
            f"{group:45s} recordings {row.recordings:4d}  cuts {row.cuts:4d}  found {row.found:4d}  "
            f"false {row.false_alarms:3d}  {1e3 * row.seconds / row.frames:5.1f} ms a frame"
        )
    return 0


def cases(worlds: Path) -> Iterator[Case]:
    """All recordings, one at a time."""
    recorded = drives()
    return chain(
        quiet(recorded, "drive"),
        quiet(drawn(worlds / "clean", []), "drawn"),
        quiet(drawn(worlds / "generated", ["--corrupt", "generated"]), "generated"),
        left_out(recorded),
        disturbed(recorded),
        joined(recorded),
        at_the_ends(recorded),
        apart(recorded),
        softened(recorded),
        photo_drives(photos()),
    )


def drawn(folder: Path, options: list[str]) -> dict[str, np.ndarray]:
    """The streets of all seeds, kept in a folder."""
    for seed in SEEDS:
        out = folder / str(seed)
        if not out.exists():
            command = [*DREAMDRIVE, "world", "make", "--seed", str(seed), *WORLD, *options, "-o", str(out)]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return {f"seed {seed}": read(folder / str(seed)) for seed in SEEDS}


def measure(case: Case, rows: dict[str, Row]) -> None:
    """Add what is found in a recording to its group."""
    row = rows.setdefault(case.group, Row())
    started = time.perf_counter()
    found = find_cuts(case.frames, np.ones(case.frames.shape[:3], dtype=bool))
    row.seconds += time.perf_counter() - started
    named = {cut.first for cut in found.cuts}
    row.recordings += 1
    row.frames += len(case.frames)
    row.cuts += len(case.cuts)
    row.found += len(named & set(case.cuts))
    row.false_alarms += len(named - set(case.cuts))
    if named != set(case.cuts):
        row.wrong.append(f"{case.name}: {sorted(named)} for {list(case.cuts)}")


def summary(rows: dict[str, Row]) -> dict[str, dict[str, object]]:
    """The figures of each group, with the names of recordings that went wrong if they are few."""
    return {
        group: {
            "recordings": row.recordings,
            "cuts": row.cuts,
            "found": row.found,
            "false_alarms": row.false_alarms,
            "ms_a_frame": round(1e3 * row.seconds / row.frames, 1),
            "wrong": row.wrong[:5],
        }
        for group, row in rows.items()
    }
