"""Where the time of a fit on the GPU goes: operations of a few steps, by time on the CPU and on the GPU."""

from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from torch.profiler import ProfilerActivity, profile

from dreamdrive.build import build_scene
from dreamdrive.compute.device import computing_on
from dreamdrive.options import QUALITIES
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.gpu.fits import Timed, shortened, sizes_in
from dreamdrive_bench.gpu.pack import load_pack

STEPS, SHOWN = 30, 12


def measure(figures: Figures, pack: Path) -> None:
    """Both fits of the smallest clip, after a run that is not looked at."""
    clip, geometry = load_pack(pack, sizes_in(pack)[0])
    known: dict[str, Any] = {"geometry": geometry}
    device = figures.device.type
    steps = 2 if figures.pretended else STEPS
    options = replace(shortened(QUALITIES["draft"], steps), device=device)
    on_gpu = [ProfilerActivity.CUDA] if device == "cuda" else []
    profiles: dict[str, profile] = {}

    def around(name: str) -> AbstractContextManager[Any]:
        if name not in ("static", "fit"):
            return nullcontext()
        profiles[name] = profile(activities=[ProfilerActivity.CPU, *on_gpu])
        return profiles[name]

    with computing_on(device):
        if not figures.pretended:
            build_scene(clip, options, run=(bare := Timed(known)))
            figures.put("seconds_without_profiler", bare.seconds)
        build_scene(clip, options, run=(timed := Timed(known, around)))
    figures.put("seconds", timed.seconds)
    figures.put("steps", steps)
    for name, made in profiles.items():
        _tell(figures, name, made)


def _tell(figures: Figures, stage: str, made: profile) -> None:
    rows = made.key_averages()
    orders = {"cpu": "self_cpu_time_total"}
    if figures.device.type == "cuda":
        orders["gpu"] = "self_device_time_total"
    for where, time_of in orders.items():
        whole = sum(getattr(row, time_of) for row in rows)
        top = sorted(rows, key=lambda row: -getattr(row, time_of))[:SHOWN]
        figures.put(stage, f"{where}_ms", whole / 1e3)
        lines = [f"{row.key[:90]}: {getattr(row, time_of) / 1e3:.2f} ms, {row.count} times" for row in top]
        figures.put(stage, f"{where}_most", lines)
    if figures.device.type == "cuda":
        torch.cuda.empty_cache()
