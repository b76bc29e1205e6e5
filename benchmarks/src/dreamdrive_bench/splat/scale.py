"""Time and memory of splatting against Gaussians, pixels and threads.

Each point is a process of its own, which loads a street, splats it and reports the best times and how much
more was resident at the peak than once the scene was loaded (Linux). Gradients go to means, quaternions,
scales, opacities and colours (SH degree 0).
"""

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.splat import threads
from dreamdrive_bench.common.machine import (
    add_patience,
    add_threads,
    describe_machine,
    undisturbed,
    use_threads,
)
from dreamdrive_bench.common.markdown import replace_section
from dreamdrive_bench.common.memory import peak_bytes, resident_bytes
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import as_json, write
from dreamdrive_bench.splat.passes import forward_backward_of, forward_of, times_ms, view_of
from dreamdrive_bench.splat.scale_report import markdown, plot, text
from dreamdrive_bench.splat.streets import SIZES, street

SIZE, COUNT = (960, 576), 500_000
COUNTS = (50_000, 100_000, 200_000, 500_000, 1_000_000, 2_000_000, 5_000_000)
PIXEL_SIZES = ((320, 192), (640, 384), (960, 576), (1280, 768), (1920, 1080))
THREADS = (1, 2, 4, 8)
QUICK_COUNTS, QUICK_SIZES, QUICK_THREADS = (50_000, 200_000, 1_000_000), PIXEL_SIZES[:3:2], (1, 2, 4)
SECONDS = 4.0  # of repeated runs at each point, though never fewer than 3 runs or more than 25


@dataclass(frozen=True)
class Point:
    """What one process measures."""

    series: str
    width: int
    height: int
    gaussians: int
    threads: int


def points(quick: bool, default_threads: int) -> list[Point]:
    """All of them, series by series."""
    counts, sizes, several = (
        (QUICK_COUNTS, QUICK_SIZES, QUICK_THREADS) if quick else (COUNTS, PIXEL_SIZES, THREADS)
    )
    return [
        *(Point("gaussians", *SIZE, count, default_threads) for count in counts),
        *(Point("pixels", *size, COUNT, default_threads) for size in sizes),
        *(Point("threads", *SIZES["b"], count) for count in several),
    ]


def measure(scene_file: Path) -> dict[str, float]:
    """Best times, and growth of memory at the peak, of a scene; in a process that has not splatted yet."""
    # What is loaded and started on first use is none of the scene's memory.
    forward_backward_of(view_of(street(64, 64, 1000)[0]))()
    with np.load(scene_file) as file:
        view = view_of(dict(file))
    runs = {"forward": forward_of(view), "forward_backward": forward_backward_of(view)}
    before = resident_bytes()
    out = {f"{name}_bytes": peak_bytes(run) - before for name, run in runs.items()}
    for name, run in runs.items():
        first_s = 1e-3 * times_ms(run, 1)[0]
        out[f"{name}_ms"] = times_ms(run, int(min(25, max(3, SECONDS / first_s))))[0]
    return out


def in_own_process(point: Point, scene_file: Path, options: argparse.Namespace) -> dict[str, object]:
    """The row of one point."""
    command = [sys.executable, "-m", "dreamdrive_bench", "scale", "--point", str(scene_file)]
    command += ["--threads", str(point.threads)]

    def run() -> dict[str, float]:
        return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)

    result, others = undisturbed(run, options)
    return asdict(point) | result | {"others": others}


def measure_all(options: argparse.Namespace) -> list[dict[str, object]]:
    """A row for each point, printed as it comes."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        scene_file = Path(folder) / "scene.npz"
        made = None
        for point in points(options.quick, threads()):
            wanted = point.width, point.height, point.gaussians
            if wanted != made:
                np.savez(scene_file, **street(*wanted)[0])
                made = wanted
            rows.append(in_own_process(point, scene_file, options))
            print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
    return rows


def parse() -> argparse.Namespace:
    """The command line."""
    parser = parser_of(__doc__)
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="a file whose section is written anew")
    parser.add_argument("--quick", action="store_true", help="a few points only")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="where a picture of them goes")
    add_threads(parser)
    add_patience(parser)
    parser.add_argument("--point", type=Path, metavar="FILE.npz", help="measure one scene, print JSON, stop")
    return parser.parse_args()


def main() -> None:
    """Measure all points, or the one that this process is for."""
    options = parse()
    use_threads(options.threads)
    if options.point is not None:
        with one_torch_thread():
            print(json.dumps(measure(options.point)))
        return
    rows = measure_all(options)
    report = {"machine": describe_machine() | {"others": max(row["others"] for row in rows)}, "rows": rows}
    print(text(report))
    write(options.json, as_json(report))
    if options.plot:
        plot(report, options.plot)
    if options.markdown:
        replace_section(options.markdown, "scale", markdown(report))
