"""One fit of the street benchmark: what it shares with others, what it costs, and its scene on disk."""

import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from dreamdrive.build import build_scene
from dreamdrive.files.digest import digest
from dreamdrive.options import Options
from dreamdrive.progress import Work, trusted
from dreamdrive.run import Stages, program_digest
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import threads
from dreamdrive.stored import load_scene, save_scene
from dreamdrive_bench.common.keep import is_current, load, save

PROBE_STEPS = 30
SHARED = ("prior", "look", "geometry", "initialise", "static")
"""Stages that all fits of a case begin with."""
T = TypeVar("T")


@dataclass(frozen=True)
class Start:
    """What the fits of a case begin with.

    Attributes:
        folder: Where results of ``SHARED`` are kept.
        about: What the clip follows from.
        read: Makes the clip.
    """

    folder: Path
    about: object
    read: Callable[[], Clip]

    def stages(self, options: Options) -> Stages:
        """Keeps what is shared by all fits of these options, a folder for each choice of them."""
        shared = digest([options.knowledge, options.geometry, options.seeds, options.static, options.device])
        folder = self.folder / shared[:8]
        return Stages(folder, None, lambda *_: None, lambda: folder.mkdir(parents=True, exist_ok=True))


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


Around = Callable[[Mapping[str, Any], Options, Callable[[], Any]], Any]
"""Makes a stage's result from all results before it, by the names of their stages, the options, and what the
stage itself would make."""


@dataclass
class Watched:
    """A ``Run`` of one fit: keeps what is shared, times the rest, and puts other stages in place of some.

    Attributes:
        kept: Of the shared stages.
        options: Of the fit.
        around: By the name of a stage.
        results: Of all stages so far; of the joint fit none.
        began_s: When the last shared stage ended, in seconds of the processor.
        steps_s: When each step of the joint fit ended.
    """

    kept: Stages
    options: Options
    around: Mapping[str, Around]
    results: dict[str, Any] = field(default_factory=dict)
    began_s: float = 0.0
    steps_s: list[float] = field(default_factory=list)

    def __call__(
        self,
        name: str,
        options: object,
        compute: Callable[[Work], T],
        *,
        check: Callable[[T], None] = trusted,
        given: T | None = None,
    ) -> T:
        """See ``Run``."""

        def usual() -> T:
            if name in SHARED:
                return self.kept(name, options, compute, check=check, given=given)
            return compute(Work(self._step if name == "fit" else lambda *_: None))

        value = self.around[name](self.results, self.options, usual) if name in self.around else usual()
        if name in SHARED:
            self.began_s = time.process_time()
        self.results[name] = value
        return value

    def _step(self, done: int, total: int) -> None:
        self.steps_s.append(time.process_time())


def fit_case(begin: Start, options: Options, around: Mapping[str, Around] | None = None) -> Fitted:
    """Read, build and time."""
    run = Watched(begin.stages(options), options, around or {})
    clip = run("prior", begin.about, lambda _: begin.read())
    scene = build_scene(clip, options, run=run).scene
    seconds, steps_s = time.process_time() - run.began_s, run.steps_s
    step_s = (steps_s[-1] - steps_s[0]) / max(len(steps_s) - 1, 1)
    return Fitted(scene, Cost(options.fit.steps, seconds, step_s, threads()))


def equal_time(begin: Start, options: Options) -> dict[str, Any]:
    """Steps of a representation in the time of hybrid, both timed now, one after the other.

    A fit of ``PROBE_STEPS`` steps passes through all phases of a long one; what is done once, such as the
    decomposition, is counted once.

    Returns:
        ``steps``, and ``hybrid_s``, the seconds of hybrid's whole fit that they follow from.
    """
    short = with_steps(options, PROBE_STEPS)
    # What a process does once is in neither.
    fit_case(begin, replace(with_steps(options, 2), representation="static"))
    hybrid = fit_case(begin, replace(short, representation="hybrid"))
    hybrid_s = hybrid.cost.of_steps(options.fit.steps)
    return {"steps": fit_case(begin, short).cost.steps_in(hybrid_s), "hybrid_s": hybrid_s}


def key_of(about: object, options: Options) -> str:
    """Of everything that a fit follows from: its clip, its options, and the program."""
    return digest([about, options, options.motion, program_digest()])


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


def with_steps(options: Options, steps: int, static_steps: int | None = None) -> Options:
    """The same with other numbers of steps."""
    static = options.static if static_steps is None else replace(options.static, steps=static_steps)
    return replace(options, fit=replace(options.fit, steps=steps), static=static)
