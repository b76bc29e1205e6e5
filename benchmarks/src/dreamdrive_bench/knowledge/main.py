"""How well the street network sees: against lidar, known cameras, and the truth of drawn streets.

Depth is up to one factor a picture, the median ratio over all points at 2 to 80 m; errors are means over
pictures, then over cameras. The baseline is a level road below the known camera with a wall at 40 m, through
the same code. Recordings are found through ``DREAMDRIVE_DATA`` (default ``../shared/data``). The weights
that ship have learned from PandaSet; their twin, which is judged where no other is named, has not.
"""

import time
from typing import Any

import numpy as np

from dreamdrive.scene.street.look import Look
from dreamdrive.street_network import LookOptions, load_knowledge, look
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.memory import peak_bytes, resident_bytes
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import as_json, write
from dreamdrive_bench.common.twin import TWIN, name_of
from dreamdrive_bench.knowledge.cameras import Frames, See, judge_camera, known_cameras
from dreamdrive_bench.knowledge.drawn import judge_drawn
from dreamdrive_bench.knowledge.lidar import Seen, judge, plane_and_backdrop
from dreamdrive_bench.knowledge.shots import Shot, kitti, pandaset

PARTS = ("lidar", "kitti", "cameras", "drawn", "cost")
WIDTH_PX = LookOptions().width_px
FRAMES = 48
SHOTS = {"lidar": pandaset, "kitti": kitti}


def main() -> int:
    """Measure the parts, print their figures and write all as JSON."""
    parser = parser_of(__doc__)
    parser.add_argument("knowledge", nargs="?", default=TWIN, metavar="street|FILE")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--baseline", action="store_true", help="the baseline alone, which needs no weights")
    parser.add_argument("--width", type=int, metavar="PX", help="for the network", default=WIDTH_PX)
    parser.add_argument("--edition", type=int, default=2, help="of the drawn streets")
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(8)), help="of the drawn streets")
    args = parser.parse_args()
    lidar = [part for part in args.parts if part in SHOTS]
    report: dict[str, Any] = {
        "machine": describe_machine(),
        "knowledge": name_of(args.knowledge),
        "width_px": args.width,
    }
    report["baseline"] = {part: judge(SHOTS[part](), plane_and_backdrop) for part in lidar}
    if not args.baseline:
        report |= {"knowledge": name_of(args.knowledge), "width_px": args.width}
        network, options = load_knowledge(args.knowledge), LookOptions(width_px=args.width)

        def see(frames: Frames) -> Look:
            return look(frames, network, options=options)

        report |= {part: judge(SHOTS[part](), lambda shot: points_of(shot, see)) for part in lidar}
        if "cameras" in args.parts:
            report["cameras"] = cameras(see)
        if "drawn" in args.parts:
            report["drawn"] = judge_drawn(args.edition, args.seeds, see)
        if "cost" in args.parts:
            report["cost"] = cost(see)
    write(args.json, as_json(report))
    print(as_json(report), end="")
    return 0


def points_of(shot: Shot, see: See) -> Seen:
    """Depth and classes of one picture."""
    seen = see(shot.frame()[None])
    return seen.depth[0], seen.classes[0]


def cameras(see: See) -> dict[str, Any]:
    """The errors of each clip, and their means."""
    rows = [judge_camera(known, see) for known in known_cameras()]
    levels = [row for row in rows if "horizon_error_deg" in row]
    return {
        "hfov_error_deg": float(np.mean([abs(row["hfov_error_deg"]) for row in rows])),
        "focal_error": float(np.mean([abs(row["focal_error"]) for row in rows])),
        "horizon_error_deg": float(np.mean([row["horizon_error_deg"] for row in levels])),
        "rows": rows,
    }


def cost(see: See) -> dict[str, float]:
    """Seconds a frame of 480x270, all in, and the most memory that many of them take, in MB."""
    rng = np.random.default_rng(0)
    frames = rng.integers(0, 255, (FRAMES, 270, 480, 3), np.uint8)
    see(frames[:2])
    before, started = resident_bytes(), time.perf_counter()
    peak = peak_bytes(lambda: see(frames))
    return {"seconds": (time.perf_counter() - started) / FRAMES, "peak_mb": (peak - before) / 1e6}
