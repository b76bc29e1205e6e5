"""Recorded drives with the street network, without it, and beside blending neighbours: the first table.

Every drive of ``list.json`` whose recording is there (``bring`` brings most) becomes a scene
from its frames alone: held-out frames beside flow interpolation between their neighbours, path error, depth
on lidar and the mask of what moves where the truth is known, what fell back, seconds. A change of geometry is
judged by this table before any other. The same command goes on where it stopped; what another program
measured is measured again. ``runs/drives/NAME-KNOWLEDGE.png`` shows each: recorded, rendered, 2 m aside, what
moves, depth.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive.files.digest import digest, file_digest
from dreamdrive.run import program_digest
from dreamdrive.street_network import NO_KNOWLEDGE, SHIPPED, weights_of
from dreamdrive_bench.common.keep import load, save
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import grid, number
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.twin import TWIN
from dreamdrive_bench.common.workers import work_off
from dreamdrive_bench.drives.drive import Drive, drives
from dreamdrive_bench.drives.measure import measure

KNOWLEDGE = {"twin": TWIN, "none": NO_KNOWLEDGE, "street": SHIPPED}
Row = dict[str, Any]


@dataclass(frozen=True)
class Job:
    """A drive with one kind of knowledge; see ``common.workers.Task``."""

    drive: Drive
    knowledge: str
    quality: str
    runs: Path

    @property
    def name(self) -> str:
        """For messages."""
        return f"{self.drive.name}-{self.knowledge}"

    block = "drives"

    @property
    def owner(self) -> str:
        """Each is its own."""
        return self.name

    @property
    def result(self) -> Path:
        """The file of its figures."""
        return self.runs / f"{self.name}.json"

    @property
    def key(self) -> str:
        """What the figures follow from."""
        known = KNOWLEDGE[self.knowledge]
        weights = "" if known == NO_KNOWLEDGE else file_digest(weights_of(known))
        return digest([program_digest(), weights, self.quality, self.drive.__dict__, "1"])


def make(job: Job) -> None:
    """Measure one and keep it."""
    known = KNOWLEDGE[job.knowledge]
    save(job.result, job.key, measure(job.drive, known, job.quality, job.result.with_suffix(".png")))


def main() -> int:
    """Measure, print the table and write all as JSON; 1 if one failed."""
    parser = parser_of(__doc__, runs="runs/drives", markdown=True)
    listed = drives()
    parser.add_argument("names", nargs="*", help="which; all unless given")
    parser.add_argument("--knowledge", nargs="+", choices=sorted(KNOWLEDGE), default=["twin", "none"])
    parser.add_argument("--quality", default="draft", choices=("draft", "standard", "high"))
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    if unknown := set(args.names) - set(listed):
        parser.error(f"unknown: {', '.join(sorted(unknown))}; known: {', '.join(listed)}")
    wanted = [listed[name] for name in args.names or listed]
    absent = [drive.name for drive in wanted if not drive.folder.exists()]
    if absent:
        print(f"not here (see bring): {', '.join(absent)}", file=sys.stderr)
    there = [drive for drive in wanted if drive.name not in absent]
    jobs = [Job(drive, name, args.quality, args.runs) for drive in there for name in args.knowledge]
    for job in jobs:
        if (found := load(job.result)) is not None and found.get("key") != job.key:
            job.result.unlink()
    failed = work_off([job for job in jobs if not job.result.exists()], make, args.workers)
    rows = [row_of(job) for job in jobs if job.result.exists()]
    report = {
        "machine": describe_machine(),
        "quality": args.quality,
        "absent": absent,
        "means": {name: means(rows, name) for name in args.knowledge},
        "rows": rows,
    }
    return publish(args, report, tables(rows, args.knowledge), [job.name for job in failed])


def row_of(job: Job) -> Row:
    """The figures of a finished one."""
    found = load(job.result)
    assert found is not None
    del found["key"]
    return {"name": job.drive.name, "knowledge": job.knowledge, **found}


def means(rows: list[Row], knowledge: str) -> dict[str, float | None]:
    """Means over all drives of one kind of knowledge."""
    own = [row for row in rows if row["knowledge"] == knowledge]
    names = ("psnr", "ssim", "flow_interpolation_psnr", "path_percent", "lidar_off", "lidar_abs_rel", "iou")
    values = {name: [row[name] for row in own if row.get(name) is not None] for name in (*names, "maps")}
    return {name: float(np.mean(each)) if each else None for name, each in values.items()}


def tables(rows: list[Row], knowledge: list[str]) -> str:
    """A line a drive and kind of knowledge, and the means."""
    head = ["drive", "knowledge", "held out", "blended", "path %", "m a step", "lidar off", "vehicles off"]
    lines = [[*head, "IoU", "maps", "s"]]
    for row in [*rows, *(mean_row(rows, name) for name in knowledge)]:
        figures = [
            number(row.get(name), form)
            for name, form in (
                ("psnr", ".2f"),
                ("flow_interpolation_psnr", ".2f"),
                ("path_percent", ".2f"),
                ("step_m", ".2f"),
                ("lidar_off", ".3f"),
                ("lidar_vehicles_off", ".3f"),
                ("iou", ".3f"),
            )
        ]
        maps = row["maps"] if isinstance(row["maps"], bool) else number(row["maps"])
        shown = {True: "drifts" if row.get("drifts") else "yes", False: "no"}.get(maps, maps)
        lines.append([row["name"], row["knowledge"], *figures, str(shown), number(row.get("seconds"), ".0f")])
    return grid(lines)


def mean_row(rows: list[Row], knowledge: str) -> Row:
    """The means as a line of the table."""
    return {"name": "mean", "knowledge": knowledge, **means(rows, knowledge)}
