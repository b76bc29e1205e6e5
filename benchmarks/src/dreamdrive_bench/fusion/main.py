"""What the street network brings to depth, motion and views: the same scenes without it and with it.

Drawn streets (edition 1, clean references, 320x192, ``draft``): shares of pixels whose depth is more than
10 % off after one scale a clip, the share of intervals said to hold 68 % that do, the mask of what moves, and
PSNR of held-out frames and from 2 m aside. Recordings with lidar: shares of points at 2 to 80 m that are more
than 10 % off after one scale a clip. What was measured with the same program is kept.
"""

import sys
from functools import partial
from typing import Any

import numpy as np

from dreamdrive.files.digest import digest, file_digest
from dreamdrive.street_network import NO_KNOWLEDGE, weights_of
from dreamdrive_bench.common.keep import kept
from dreamdrive_bench.common.machine import COMMIT, describe_machine
from dreamdrive_bench.common.markdown import grid, number
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.twin import TWIN, name_of
from dreamdrive_bench.common.worlds import DEVELOPMENT, set_of
from dreamdrive_bench.fusion.clips import CLIPS, judge_clip
from dreamdrive_bench.fusion.worlds import judge_world
from dreamdrive_bench.street.case import Case, case_digest

Row = dict[str, Any]


def main() -> int:
    """Measure, print the tables and write all as JSON."""
    parser = parser_of(__doc__, runs="runs/fusion", markdown=True)
    parser.add_argument("knowledge", nargs="*", default=[TWIN], metavar="street|FILE")
    parser.add_argument("--seeds", type=int, nargs="*", default=list(DEVELOPMENT))
    parser.add_argument("--poses", nargs="+", choices=("true", "estimated"), default=["true", "estimated"])
    parser.add_argument("--clips", nargs="*", choices=sorted(CLIPS), default=sorted(CLIPS))
    args = parser.parse_args()
    worlds: list[Row] = []
    clips: list[Row] = []
    for knowledge in (NO_KNOWLEDGE, *args.knowledge):
        name = name_of(knowledge)
        known = "" if knowledge == NO_KNOWLEDGE else file_digest(weights_of(knowledge))
        for case in (Case(seed, poses, "clean") for poses in args.poses for seed in args.seeds):
            key = digest([COMMIT, known, case_digest(case)])
            path = args.runs / f"{case.name}-{known[:8]}.json"
            found = kept(path, key, partial(judge_world, case, knowledge, args.runs))
            worlds.append({"knowledge": name, "poses": case.geometry, "seed": case.seed, **found})
            print(worlds[-1], file=sys.stderr, flush=True)
        for clip in args.clips:
            path, key = args.runs / f"{clip}-{known[:8]}.json", digest([COMMIT, known, clip])
            found = kept(path, key, partial(judge_clip, clip, knowledge))
            clips.append({"knowledge": name, "clip": clip, **found})
            print(clips[-1], file=sys.stderr, flush=True)
    report = {
        "machine": describe_machine(),
        "worlds": {"set": set_of(args.seeds), "means": means(worlds), "rows": worlds},
        "clips": clips,
    }
    tables = (report["worlds"]["means"], clips)
    return publish(args, report, "\n".join(as_table(rows) for rows in tables if rows), ())


def as_table(rows: list[Row]) -> str:
    """A line a row; words as they are, shares and decibels with three digits."""
    names = [name for name in rows[0] if name not in ("fallback", "frames")]
    lines = [
        [cell if isinstance(cell := row.get(name), str) else number(cell, ".4g") for name in names]
        for row in rows
    ]
    return grid([names, *lines])


def means(rows: list[Row]) -> list[Row]:
    """Means over the worlds of each knowledge and each kind of poses."""
    found: list[Row] = []
    for knowledge, poses in dict.fromkeys((row["knowledge"], row["poses"]) for row in rows):
        same = [row for row in rows if (row["knowledge"], row["poses"]) == (knowledge, poses)]
        mean: Row = {"knowledge": knowledge, "poses": poses, "worlds": len(same)}
        for name in same[0]:
            values = [row[name] for row in same if isinstance(row[name], float)]
            if values and name not in mean:
                mean[name] = float(np.mean(values))
        found.append(mean)
    return found
