"""Fits of a packed clip on both devices: seconds of each stage, likeness of held-out frames."""

import os
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from dreamdrive.build import Built, build_scene
from dreamdrive.compute.device import computing_on
from dreamdrive.names import DeviceName, QualityName
from dreamdrive.options import QUALITIES, Options
from dreamdrive.progress import Work
from dreamdrive.run import score_scene
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.street_network import NO_KNOWLEDGE
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.gpu.pack import load_pack, name_of

SMALL, LARGE = (480, 270), (960, 540)
Case = tuple[tuple[int, int], QualityName, DeviceName]
CASES: tuple[Case, ...] = (
    (SMALL, "draft", "cuda"),
    (SMALL, "draft", "cuda"),
    (SMALL, "draft", "cpu"),
    (SMALL, "standard", "cuda"),
    (LARGE, "draft", "cuda"),
    (SMALL, "standard", "cpu"),
    (LARGE, "draft", "cpu"),
    (LARGE, "standard", "cuda"),
)
"""In the order of what is wanted most."""
ON_TWO_CORES: tuple[Case, ...] = ((SMALL, "draft", "cpu"), (SMALL, "standard", "cpu"))


@dataclass
class Timed:
    """Runs stages, all but those that are known, inside what ``around`` gives, and says what each took."""

    known: dict[str, Any]
    around: Callable[[str], AbstractContextManager[Any]] = lambda name: nullcontext()
    seconds: dict[str, float] = field(default_factory=dict)

    def __call__(
        self,
        name: str,
        options: object,
        compute: Callable[[Work], Any],
        *,
        check: Any = None,
        given: Any = None,
    ) -> Any:
        """See ``progress.Run``."""
        if name not in self.known:
            begin = time.perf_counter()
            with self.around(name):
                value = compute(Work())
                if torch.cuda.is_available():
                    torch.cuda.synchronize()
            self.seconds[name] = time.perf_counter() - begin
            if name != "look":
                return value
            self.known[name] = value
        return self.known[name]


def sizes_in(pack: Path) -> list[tuple[int, int]]:
    """The sizes that a pack has, the smallest first."""
    names = [each.name.split("x") for each in pack.iterdir() if each.is_dir()]
    return sorted((int(width), int(height)) for width, height in names)


def shortened(options: Options, steps: int) -> Options:
    """With so many steps in each fit."""
    few = {n: replace(getattr(options, n), steps=steps, least_visits=0) for n in ("static", "fit")}
    return replace(options, **few, score=replace(options.score, steps=min(steps, options.score.steps)))


def measure(figures: Figures, pack: Path, cases: tuple[Case, ...] = CASES) -> None:
    """All cases, one after the other in one process."""
    clips: dict[tuple[int, int], tuple[Clip, Geometry, dict[str, Any]]] = {}
    figures.put("cores", len(os.sched_getaffinity(0)))
    figures.put("fits", [])
    if figures.pretended:
        size = sizes_in(pack)[0]
        cases = ((size, "draft", "cpu"),)
    for number, (size, quality, device) in enumerate(cases):
        with figures.attempt(f"{name_of(size)} {quality} {device} ({number})"):
            if size not in clips:
                clip, geometry = load_pack(pack, size)
                clips[size] = clip, geometry, {"geometry": geometry}
            options = QUALITIES[quality]
            if figures.pretended:
                options = replace(shortened(options, 2), knowledge=NO_KNOWLEDGE)
            told = fitted(figures, *clips[size], replace(options, device=device))
            told = {"size": name_of(size), "quality": quality, "fit_of_its_process": number + 1} | told
            figures.put("fits", [*figures.values["fits"], told])


def fitted(
    figures: Figures, clip: Clip, geometry: Geometry, known: dict[str, Any], options: Options
) -> dict[str, Any]:
    """One fit and what came of it."""
    run = Timed(known)
    on_gpu = options.device == "cuda"
    if on_gpu:
        torch.cuda.reset_peak_memory_stats()
    with computing_on(options.device):
        built = build_scene(clip, options, run=run)
    scores = score_scene(clip, geometry, built.scene)
    return {
        "device": options.device,
        "seconds": run.seconds["static"] + run.seconds["fit"],
        "stages_s": run.seconds,
        "steps": options.for_clip(clip).steps,
        "psnr": float(np.mean([each.psnr for each in scores.values()])),
        "ssim": float(np.mean([each.ssim for each in scores.values()])),
        "gaussians": _counts(built),
        **(figures.memory() if on_gpu else {}),
    }


def _counts(built: Built) -> list[int]:
    return [len(built.scene.static), len(built.scene.dynamic)]
