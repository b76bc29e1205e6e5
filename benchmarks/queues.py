"""Structure from motion of a queue: a drawn street whose picture is three quarters traffic that moves.

    python benchmarks/queues.py [--worlds development|test] [--seeds S ...] [--calibrated]
                                [--knowledge none outlines FILE ...] [--json FILE] [--markdown FILE]

The path of the recording car is found from the frames alone (``none``), from the frames and the true
outlines of all road users (``outlines``), or with the street network of a file of weights or a name that
ships. Outlines tell nothing of the lens. The lens is a guess, or with ``--calibrated`` the true one. Path
errors are after the best similarity, in per cent of the length; where structure from motion was refused they
are those of frame-to-frame odometry. Traffic is the share of all pixels in which a road user moves.
"""

import argparse
import sys
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from functools import lru_cache

import numpy as np

from common.drawn import drawn_clip
from common.machine import describe_machine
from common.options import parser_of
from common.report import publish
from common.true_look import true_look
from common.twin import TWIN, name_of
from common.worlds import SETS
from dreamdrive.evaluate.paths import compare_paths
from dreamdrive.geometry.cameras import pose_clip
from dreamdrive.knowledge import NO_KNOWLEDGE, look_at, with_looks
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.world import Drive, StreetOptions, draw_street, drive

FRAMES, RATE_HZ, SIZE, EDITION = 24, 10.0, (480, 270), 2
SEEDS = 8
"""Of each set, from its first on."""
OUTLINES = "outlines"
GOAL_PERCENT = 0.5


@dataclass(frozen=True)
class Row:
    """One street, with one knowledge of its road users.

    Attributes:
        seed: Of the street.
        knowledge: What is told of road users.
        traffic: Share of pixels of moving road users.
        path_m: Length of the true path.
        refused: Why structure from motion was not used; None where it was.
        path_percent: Root mean square distance of the positions over the length of the path.
        rotation_deg_per_m: Mean difference in heading over stretches of the path.
        focal_percent: By how much the focal length is too long.
        seconds: Seconds of finding the path, without those of the network.
    """

    seed: int
    knowledge: str
    traffic: float
    path_m: float
    refused: str | None
    path_percent: float
    rotation_deg_per_m: float
    focal_percent: float
    seconds: float

    @property
    def good(self) -> bool:
        """Whether structure from motion found the path."""
        return self.refused is None and self.path_percent <= GOAL_PERCENT


def main() -> int:
    """Measure each street, print the table, write both."""
    args = parse()
    rows: list[Row] = []
    for seed in args.seeds or SETS[args.worlds][:SEEDS]:
        for knowledge in args.knowledge:
            rows.append(measure(seed, knowledge, args.calibrated))
            print(rows[-1], file=sys.stderr, flush=True)
    report = {"machine": describe_machine(), "calibrated": args.calibrated, "rows": [asdict(r) for r in rows]}
    return publish(args, report, table(rows), [])


def parse() -> argparse.Namespace:
    """The command line."""
    parser = parser_of(__doc__, markdown=True)
    parser.add_argument("--worlds", choices=SETS, default="development", help="the first eight of a set")
    parser.add_argument("--seeds", type=int, nargs="+", metavar="S", help="others than those")
    parser.add_argument("--knowledge", nargs="+", default=[NO_KNOWLEDGE, TWIN, OUTLINES], metavar="WHAT")
    parser.add_argument("--calibrated", action="store_true", help="the lens is known")
    return parser.parse_args()


@lru_cache(1)
def queue_of(seed: int) -> Drive:
    """The drive of a seed."""
    options = StreetOptions(FRAMES / RATE_HZ, edition=EDITION, traffic="queue")
    return drive(draw_street(seed, options), FRAMES, RATE_HZ, SIZE)


def told(made: Drive, knowledge: str, calibrated: bool) -> Clip:
    """The frames of a drive, with what is known of its road users."""
    clip = drawn_clip(made, known=Known(intrinsics=calibrated))
    if knowledge == OUTLINES:
        return with_looks(clip, (true_look(made, clip.rig[0].fx_px),))
    return with_looks(clip, look_at(clip, knowledge))


def measure(seed: int, knowledge: str, calibrated: bool) -> Row:
    """Find the path of a street."""
    made = queue_of(seed)
    clip = told(made, knowledge, calibrated)
    began = time.perf_counter()
    posed = pose_clip(clip)
    seconds = time.perf_counter() - began
    found = np.stack([camera.world_from_camera for camera in posed.cameras])
    error = compare_paths(found, made.trajectory.world_from_camera)
    assert error is not None, "queues move"
    return Row(
        seed=seed,
        knowledge=name_of(knowledge),
        traffic=float(made.moving.mean()),
        path_m=made.trajectory.length_m,
        refused=posed.fallback,
        path_percent=error.ate_percent,
        rotation_deg_per_m=error.rotation_deg_per_m,
        focal_percent=100 * posed.cameras[0].fx_px / made.cameras[0].fx_px - 100,
        seconds=seconds,
    )


def table(rows: Iterable[Row]) -> str:
    """A line a street and knowledge, and one a knowledge, in Markdown."""
    rows = list(rows)
    lines = [
        "| seed | knowledge | traffic | path m | path error % | heading deg/m | focal error % | s | |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    lines += [
        f"| {r.seed} | {r.knowledge} | {r.traffic:.2f} | {r.path_m:.1f} | {r.path_percent:.2f} | "
        f"{r.rotation_deg_per_m:.3f} | {r.focal_percent:+.1f} | {r.seconds:.0f} | {r.refused or ''} |"
        for r in rows
    ]
    for knowledge in dict.fromkeys(r.knowledge for r in rows):
        of = [r for r in rows if r.knowledge == knowledge]
        lines.append(
            f"\n{knowledge}: refused {sum(r.refused is not None for r in of)} of {len(of)}, found within "
            f"{GOAL_PERCENT} % {sum(r.good for r in of)}, median error "
            f"{np.median([r.path_percent for r in of]):.2f} %"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
