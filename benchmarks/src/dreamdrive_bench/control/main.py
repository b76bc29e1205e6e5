"""Does a scene follow its layout? One box moved by 2 m, or the road's edge by 0.5 m, and all else the same.

Every seed gives a street; it is generated once as drawn and once for each change, with the same seed. For a
moving vehicle (one that the first scene finds, if any) and for a parked one its Gaussians in the first
scene (the dynamic ones that show it, or, parked, all that do) are moved along the change until the first
scene looks most like the second; that nothing else tells where it is now, so that a scene in which it has
not moved gives 0 m, and one in which it is not there nothing. For the road's edge (straight streets: seeds
that 3 divides) it is the edge at which a clean drawing of the world is most like the changed scene. PSNR
compares the renders of both scenes where the change is not: outside the vehicle's masks in both worlds and
whatever else differs between the worlds' clean frames (shadows, the strip beside the edge), widened by 8
px. --geometry true hands exact poses and depth over.
"""

import argparse
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from dreamdrive.scene.similarity import Similarity
from dreamdrive_bench.common.machine import use_all_cores
from dreamdrive_bench.common.markdown import columns, laid_out, number
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import as_json, write
from dreamdrive_bench.control.compare import compare, edge_of
from dreamdrive_bench.control.layout_edits import move_box, widen_road
from dreamdrive_bench.control.made import FPS, aligned, found_in, make
from dreamdrive_bench.control.shift import shift
from streetworld import StreetOptions, draw_street

MOVE_M, EDGE_M = 2.0, 0.5


@dataclass(frozen=True)
class Row:
    """What one change does.

    Attributes:
        seed: The street, and the seed of everything random.
        change: ``moving``, ``parked`` or ``edge``.
        what: The box and the way it goes.
        wanted_m: How far it was moved.
        shift_m: How far the scene moved it, in the scene's own metres; None where that is not found.
        aligned_m: The same with both scenes brought onto the truth by their cameras.
        frames: Number of frames in which it was looked for, or that were compared.
        psnr: Between the renders of both scenes, where the change is not.
        kept: Share of the pixels that this is.
        worlds_psnr: The same between the worlds' clean frames.
    """

    seed: int
    change: str
    what: str
    wanted_m: float
    shift_m: float | None
    aligned_m: float | None
    frames: int
    psnr: float
    kept: float
    worlds_psnr: float


CELLS = {
    "change": lambda row: row.change,
    "seed": lambda row: str(row.seed),
    "what": lambda row: row.what,
    "wanted m": lambda row: number(row.wanted_m),
    "shift m": lambda row: number(row.shift_m),
    "aligned m": lambda row: number(row.aligned_m),
    "frames": lambda row: str(row.frames),
    "PSNR": lambda row: f"{row.psnr:.1f}",
    "kept": lambda row: f"{100 * row.kept:.0f} %",
    "worlds": lambda row: f"{row.worlds_psnr:.1f}",
}
"""The columns of the table for a terminal."""


def main() -> None:
    """Generate, measure, print one table and write it as JSON."""
    options = arguments()
    use_all_cores()
    rows: list[Row] = []
    for seed in options.seeds:
        found = measure(seed, options)
        rows += found
        print(laid_out(CELLS, found, columns), flush=True)
        settings = {k: str(v) if isinstance(v, Path) else v for k, v in vars(options).items() if k != "json"}
        write(options.json, as_json({"settings": settings, "rows": [asdict(row) for row in rows]}))


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = parser_of(__doc__, runs="runs/control")
    parser.add_argument("--quick", action="store_true", help="one street, 12 frames of 160x96")
    parser.add_argument("--seeds", type=int, nargs="+")
    parser.add_argument("--frames", type=int)
    parser.add_argument("--size", type=int, nargs=2, metavar=("W", "H"))
    parser.add_argument("--quality", default="draft")
    parser.add_argument("--geometry", choices=("estimated", "true"), default="estimated")
    options = parser.parse_args()
    options.seeds = options.seeds or ([3] if options.quick else [0, 3, 5])
    options.frames = options.frames or (12 if options.quick else 24)
    options.size = tuple(options.size or ((160, 96) if options.quick else (320, 192)))
    return options


def measure(seed: int, options: argparse.Namespace) -> list[Row]:
    """All changes of one street."""
    layout = draw_street(seed, StreetOptions(seconds=options.frames / FPS))
    before = make(layout, f"{seed}", seed, options)
    rows: list[Row] = []
    for change in ("moving", "parked"):
        edit = move_box(before.drive, change == "moving", MOVE_M, found_in(before))
        after = make(edit.layout, f"{seed}-{change}", seed, options)
        world_m = after.drive.world_from_map[:3, :2] @ edit.moved_m
        instance = next(box.instance for box in after.drive.boxes if box.id == edit.id)
        shifts = [
            shift(before, after, instance, world_m, change == "moving", brought)
            for brought in (lambda _: Similarity(1.0, np.eye(3), np.zeros(3)), aligned)
        ]
        what = f"{edit.id} {edit.way}"
        row = compare(before, after, instance)
        rows.append(Row(seed, change, what, MOVE_M, shifts[0][0], shifts[1][0], shifts[0][1], *row))
    if seed % 3 == 0:
        wide = make(widen_road(layout, EDGE_M), f"{seed}-edge", seed, options)
        edges = edge_of(wide, layout), edge_of(before, layout)
        moved = None if None in edges else edges[0] - edges[1]
        row = compare(before, wide, None)
        rows.append(Row(seed, "edge", "right edge out", EDGE_M, moved, None, len(wide.views), *row))
    return rows
