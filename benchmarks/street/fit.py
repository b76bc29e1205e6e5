"""One fit of the street benchmark: a representation on a case, what it costs, and its scene on disk."""

import shutil
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from common.keep import is_current, load, save
from common.workers import threads
from dreamdrive import __version__
from dreamdrive.decompose import cast, error_maps, group, score
from dreamdrive.decompose.group import Grouping
from dreamdrive.fit import Parts, fit
from dreamdrive.motion import RepresentationName
from dreamdrive.options import Quality
from dreamdrive.run.stages import stage_seed
from dreamdrive.scene.folder import load_scene, save_scene
from dreamdrive.scene.scene import Scene
from street.case import Start

PROBE_STEPS = 30
Vote = Callable[[Start, torch.Tensor, Quality], Grouping]
"""From the scores of the seeds to what of them is dynamic, and in which thing."""
Errors = Callable[[Start, Quality], np.ndarray]
"""From a static fit to the error maps (F, H, W) that the scores are trained on."""


@dataclass(frozen=True)
class Cost:
    """What a fit cost beyond the static one, which all share.

    Seconds are the processor's, summed over threads: what else runs on the machine counts little, and with a
    core for each worker they are those of a clock.

    Attributes:
        steps: Steps of the joint fit.
        seconds: Of decomposition and joint fit.
        step_s: A step, without what is done once.
        threads: On how many it was measured.
    """

    steps: int
    seconds: float
    step_s: float
    threads: int

    def of_steps(self, steps: int) -> float:
        """Seconds that another number of steps would take."""
        return self.seconds + (steps - self.steps) * self.step_s

    def steps_in(self, seconds: float) -> int:
        """Steps that take so many seconds, what is done once included; at least one."""
        return max(1, self.steps + round((seconds - self.seconds) / self.step_s))


@dataclass(frozen=True)
class Fitted:
    """A scene and what it cost."""

    scene: Scene
    cost: Cost


def own_vote(begin: Start, scores: torch.Tensor, quality: Quality) -> Grouping:
    """Hybrid's grouping."""
    return group(begin.clip, begin.geometry, begin.seeds, scores, quality.group)


def own_errors(begin: Start, quality: Quality) -> np.ndarray:
    """Hybrid's errors: of colour, absolute."""
    fitted = begin.static
    return error_maps(begin.clip, begin.geometry, fitted.gaussians, fitted.sky, fitted.exposure)


def fit_case(
    begin: Start,
    representation: RepresentationName,
    quality: Quality,
    vote: Vote = own_vote,
    errors: Errors = own_errors,
) -> Fitted:
    """Decompose, if the representation does, and fit."""
    at = time.process_time()
    parts = _parts(begin, representation, quality, vote, errors)
    steps_at: list[float] = []
    scene = fit(
        begin.clip,
        begin.geometry,
        parts,
        begin.static,
        quality.fit,
        quality.motion(representation),
        quality.densify,
        stage_seed(0, "fit"),
        lambda *_: steps_at.append(time.process_time()),
    )
    end = time.process_time()
    step_s = (steps_at[-1] - steps_at[0]) / max(len(steps_at) - 1, 1)
    return Fitted(scene, Cost(quality.fit.steps, end - at, step_s, threads()))


def _parts(
    begin: Start, representation: RepresentationName, quality: Quality, vote: Vote, errors: Errors
) -> Parts:
    fitted, nothing = begin.static.gaussians, torch.zeros(0, dtype=torch.int64)
    if representation == "static":
        return Parts(fitted, fitted.select(nothing), None, ())
    if representation != "hybrid":
        return Parts(begin.seeds.select(nothing), fitted, None, ())
    clip, geometry, seeds = begin.clip, begin.geometry, begin.seeds
    maps = errors(begin, quality)
    scores = score(clip, geometry, seeds, maps, quality.score, stage_seed(0, "score"), lambda *_: None)
    grouping = vote(begin, scores, quality)
    moving = cast(clip, geometry, seeds, grouping, quality.cast)
    return Parts(fitted.select(grouping.static), moving.gaussians, moving.tracks, moving.actors)


def equal_time(begin: Start, representation: RepresentationName, quality: Quality) -> dict[str, Any]:
    """Steps of a representation in the time of hybrid, both timed now, one after the other.

    A fit of ``PROBE_STEPS`` steps passes through all phases of a long one; what is done once, such as the
    decomposition, is counted once.

    Returns:
        ``steps``, and ``hybrid_s``, the seconds of hybrid's whole fit that they follow from.
    """
    short = with_steps(quality, PROBE_STEPS)
    fit_case(begin, "static", with_steps(quality, 2))  # what a process does once is in neither
    hybrid_s = fit_case(begin, "hybrid", short).cost.of_steps(quality.fit.steps)
    return {"steps": fit_case(begin, representation, short).cost.steps_in(hybrid_s), "hybrid_s": hybrid_s}


def options_of(quality: Quality, representation: RepresentationName) -> dict[str, Any]:
    """All options that a fit of a representation depends on, for a digest."""
    names = ["static", "fit", "seeds", "densify"]
    names += ["score", "group", "cast"] if representation == "hybrid" else []
    used = {name: asdict(getattr(quality, name)) for name in names}
    return {**used, "motion": asdict(quality.motion(representation)), "version": __version__}


def kept_fit(folder: Path, key: str, make: Callable[[], Fitted]) -> Fitted:
    """The scene in a folder if it is of this key, else a new one, which is kept there.

    Either way it is the one read from the disk, so that what is measured does not depend on when.
    """
    about = folder.with_name(f"{folder.name}.json")
    if not (is_current(about, key) and folder.exists()):
        about.unlink(missing_ok=True)
        made = make()
        folder.parent.mkdir(parents=True, exist_ok=True)
        save_scene(made.scene, folder, replace=True)
        save(about, key, asdict(made.cost))
    found = load(about)
    assert found is not None
    del found["key"]
    return Fitted(load_scene(folder), Cost(**found))


class FitTask:
    """A fit of which scene and figures are kept.

    Attributes:
        runs: The folder of all fits.
        name: For files and messages.
        result: Where its figures are kept.
    """

    runs: Path
    name: str
    result: Path

    @property
    def scene(self) -> Path:
        """Where its scene is kept, which a changed measurement takes again."""
        return self.runs / "scenes" / self.name

    def forget(self) -> None:
        """Remove all that is kept of it, so that it is fitted again."""
        about = ("json", "plan.json")
        for path in (self.result, *(self.scene.with_name(f"{self.name}.{suffix}") for suffix in about)):
            path.unlink(missing_ok=True)
        if self.scene.exists():
            shutil.rmtree(self.scene)


def with_steps(quality: Quality, steps: int, static_steps: int | None = None) -> Quality:
    """The same with other numbers of steps."""
    static = quality.static if static_steps is None else replace(quality.static, steps=static_steps)
    return replace(quality, fit=replace(quality.fit, steps=steps), static=static)
