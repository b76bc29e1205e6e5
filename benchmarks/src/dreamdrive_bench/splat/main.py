"""Milliseconds of splatting, forward and forward + backward, on the scenes in ``DREAMDRIVE_BENCH``.

A scene is t, a, b, c or an .npz file. Gradients go to means, quaternions, scales, opacities and colours (SH
degree 0). Times are medians, or the best where it says so. Shown are

- how many times faster we are than OpenSplat's CPU rasteriser (a, b, c), as published and as scaled;
- how near each stage is to the least time its operations and bytes can take here;
- the difference of the image from a float64 program: that in ``DREAMDRIVE_BENCH``, else our own;
- OpenSplat itself, measured here, if ``--opensplat`` names a checkout of it (version of November 2025);
- the project's plain-torch twin on 1,000 Gaussians at 160 x 96: never counted.

Without a C++ compiler the second and third are left out.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import torch

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.splat import native_info, rasterize, stage_seconds, threads
from dreamdrive_bench.common.machine import (
    add_patience,
    add_threads,
    describe_machine,
    undisturbed,
    use_threads,
)
from dreamdrive_bench.common.markdown import replace_section
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import as_json, write
from dreamdrive_bench.splat.opensplat import load_opensplat, opensplat_passes
from dreamdrive_bench.splat.passes import (
    View,
    best_and_median,
    forward_backward_of,
    forward_of,
    times_ms,
    view_of,
)
from dreamdrive_bench.splat.peer import THREADS as PEER_THREADS, TIMES_MS, compare, compare_older
from dreamdrive_bench.splat.programs import Scene, common_image, measure_peaks, walk
from dreamdrive_bench.splat.report import markdown, text
from dreamdrive_bench.splat.roofline import FORWARD, STAGES, least_ms, roofline
from dreamdrive_bench.splat.streets import COMMON, load

LANES = {"baseline": 4, "avx2": 8, "avx512": 16}


def measure(name: str, scene: Scene, source: str, options: argparse.Namespace, peaks) -> dict:
    """One row of the result."""
    view = view_of(scene)
    with one_torch_thread():
        timed, others = undisturbed(lambda: time_passes(view, options.repeat), options)
        render = rasterize(**view.tensors, **view.camera)
    forward, both, stages_s = timed
    work, expected = float64(scene)
    row = {
        "name": name,
        "source": source,
        "width": view.camera["width_px"],
        "height": view.camera["height_px"],
        "gaussians": len(view.tensors["means"]),
        "visible": int(render.visible.sum()),
        "forward_ms": forward[1],
        "forward_backward_ms": both[1],
        "best_forward_ms": forward[0],
        "best_forward_backward_ms": both[0],
        "others": others,
        **difference(expected, render.colour.numpy()),
    }
    if source == COMMON and name in TIMES_MS and options.threads <= PEER_THREADS:
        row["peer"] = compare(name, (forward[0], both[0]), peaks)
    if peaks is not None and work is not None:
        row |= bounds(row, work, peaks, stages_s)
    if options.opensplat is not None:
        times, image = measure_opensplat(scene, view, options)
        row["opensplat"] = against_opensplat(row, times) | difference(expected, image)
    return row


def time_passes(view: View, repeat: int) -> tuple[tuple[float, float], tuple[float, float], dict[str, float]]:
    """Best and median of the forward pass and of both passes, and the least seconds of each stage in both."""
    forward = times_ms(forward_of(view), repeat)
    seen: list[dict[str, float]] = []
    both = times_ms(forward_backward_of(view), repeat, lambda: seen.append(stage_seconds()))
    stages_s = {stage: min(one[stage] for one in seen) for stage in STAGES}
    return best_and_median(forward), best_and_median(both), stages_s


def float64(scene: Scene) -> tuple[dict[str, int] | None, np.ndarray | None]:
    """What there is to do in a scene, and its float64 image; None without a compiler."""
    walked = walk(scene, LANES[native_info()["isa"]])
    if walked is None:
        return None, None
    common = common_image(scene)
    return walked[0], walked[1] if common is None else common


def difference(expected: np.ndarray | None, image: np.ndarray) -> dict[str, float | None]:
    """Largest and mean absolute difference of the image from the float64 one, where there is one."""
    if expected is None:
        return {"max_abs_error": None, "mean_abs_error": None}
    error = np.abs(expected - image)
    return {"max_abs_error": float(error.max()), "mean_abs_error": float(error.mean())}


def bounds(row: dict, work: dict[str, int], peaks: dict[str, float], stages_s: dict[str, float]) -> dict:
    """How near the stages of a scene are to the least time for its work."""
    stages = roofline(work, row["gaussians"], row["width"] * row["height"], peaks, stages_s)
    floor_ms = least_ms(stages, FORWARD), least_ms(stages, STAGES)
    times = row["best_forward_ms"], row["best_forward_backward_ms"]
    shares = [floor / ms for floor, ms in zip(floor_ms, times, strict=True)]
    return {"work": work, "stages": stages, "floor_ms": floor_ms, "roofline_share": shares}


def measure_opensplat(
    scene: Scene, view: View, options: argparse.Namespace
) -> tuple[tuple[float, float], np.ndarray]:
    """Times of the peer's older version, of the processor as it has but one thread; and its image."""
    module = load_opensplat(options.opensplat)
    forward, both = opensplat_passes(module, view, torch.from_numpy(scene["colors"]))
    repeat = min(5, options.repeat)
    with one_torch_thread():
        forward_ms, both_ms = (times_ms(run, repeat, clock=time.process_time)[0] for run in (forward, both))
        return (forward_ms, both_ms), forward().numpy()


def against_opensplat(row: dict, times: tuple[float, float]) -> dict:
    """How many times faster we are, and what follows for the newer version."""
    ours = row["best_forward_ms"], row["best_forward_backward_ms"]
    out = {"ms": times, "ratio": [peer / mine for peer, mine in zip(times, ours, strict=True)]}
    return out | compare_older(row["name"], times, ours) if "peer" in row else out


def against_twin(scene: Scene) -> dict:
    """The compiled backend and plain torch on the same small piece of a scene."""
    whole = view_of(scene)
    scale = 160 / whole.camera["width_px"]
    camera = {k: scale * whole.camera[k] for k in ("fx_px", "fy_px", "cx_px", "cy_px")}
    camera |= {"width_px": 160, "height_px": 96}
    count = len(whole.tensors["means"])
    keep = torch.arange(0, count, max(1, count // 1000))[:1000]
    part = {k: v if k == "camera_from_world" else v[keep] for k, v in whole.tensors.items()}
    view = View(part, camera, torch.randn(96, 160, 3, generator=torch.Generator().manual_seed(0)))
    times = {}
    for backend, repeat in (("native", 9), ("reference", 3)):
        runs = forward_of(view, backend), forward_backward_of(view, backend)
        times[backend] = [best_and_median(times_ms(run, repeat))[1] for run in runs]
    return {
        "peer": "plain torch reference, 1,000 Gaussians, 160x96",
        "native_ms": times["native"],
        "peer_ms": times["reference"],
        "ratio": [peer / ours for peer, ours in zip(times["reference"], times["native"], strict=True)],
    }


def parse() -> argparse.Namespace:
    """The command line."""
    parser = parser_of(__doc__)
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="a file whose section is written anew")
    parser.add_argument("--scenes", nargs="+", default=["a"], metavar="SCENE", help="t, a, b, c or FILE.npz")
    parser.add_argument("--repeat", type=int, default=15, metavar="N", help="runs a figure is the median of")
    add_threads(parser)
    add_patience(parser)
    parser.add_argument("--opensplat", type=Path, metavar="DIR", help="checkout of OpenSplat to measure too")
    options = parser.parse_args()
    use_threads(options.threads)
    options.threads = threads()
    return options


def main() -> None:
    """Measure the scenes asked for."""
    options = parse()
    scenes = [load(name) for name in options.scenes]
    peaks, _ = undisturbed(lambda: measure_peaks(options.threads), options)
    rows = [measure(*scene, options, peaks) for scene in scenes]
    report = {
        "scenes": rows,
        "twin": against_twin(scenes[0][1]),
        "peaks": peaks,
        "machine": describe_machine() | {"others": max(row["others"] for row in rows)},
        "statistic": f"median of {options.repeat}",
    }
    print(text(report))
    write(options.json, as_json(report))
    if options.markdown:
        replace_section(options.markdown, "splat", markdown(report))
