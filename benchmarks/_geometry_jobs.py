"""What the geometry benchmark measures, the most telling first."""

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

import clips
from _geometry_alignment import EASY, PAPER, STEPS, Alignment
from _geometry_backends import RECORDINGS, STREETS, BackendRun
from _geometry_worlds import SEEDS
from _simulated_pairs import Noise

from dreamdrive.geometry.dust3r.pairs import video_graph

HARD = Noise(mistaken=True)
APART = Noise(mistaken=False, unseen=3)
PATHS = ("bend a", "corner a")  # of the choice of graph
GRAPHS = (
    "swin-2-noncyclic",
    "swin-3-noncyclic",
    "swin-5-noncyclic",
    "logwin-3-noncyclic",
    "logwin-4-noncyclic",
    "logwin-5-noncyclic",
)
SPEED_SIZES = ((96, 64), (128, 80), (192, 112), (512, 288))
WHOLE_PX = 128 * 80  # sizes beyond: a few steps of Adam tell the seconds of all
FEW_STEPS = 3
SCENES = ("pandaset-draft", "pandaset-files-draft")  # of clips.py
MEMORY_FRAMES = (8, 16, 32, 64, 128)
FULL_SIZE = (512, 288)


class Measurement(Protocol):
    """Something that is measured and kept."""

    @property
    def name(self) -> str:
        """For messages."""
        ...

    @property
    def result(self) -> Path:
        """The file."""
        ...

    def measure(self) -> dict[str, Any]:
        """The figures."""
        ...


@dataclass(frozen=True)
class MemoryRun:
    """One alignment in a process of its own.

    Attributes:
        frames: Number of frames.
        size: Width and height in pixels.
        graph: Which pairs there are.
        dtype: Of the pointmaps.
        memory_gb: What is allowed.
        runs: Folder of the results.
    """

    frames: int
    size: tuple[int, int] = FULL_SIZE
    graph: str = "swin-3-noncyclic"
    dtype: str = "float32"
    memory_gb: float = 4.0
    runs: Path = Path("runs/geometry")

    @property
    def name(self) -> str:
        """For messages and files."""
        return f"memory-{self.frames}-{self.size[0]}x{self.size[1]}-{self.graph}-{self.dtype}"

    @property
    def result(self) -> Path:
        """The file."""
        return self.runs / "cases" / f"{self.name}.json"

    def measure(self) -> dict[str, Any]:
        """Bytes and seconds, or why it was refused."""
        program = Path(__file__).with_name("_geometry_memory.py")
        told = [self.frames, *self.size, self.graph, self.dtype, self.memory_gb]
        command = [sys.executable, str(program), *map(str, told)]
        found = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
        return {key: value for key, value in asdict(self).items() if key != "runs"} | found


@dataclass(frozen=True)
class SceneRun:
    """A clip through ``dreamdrive generate``, as ``clips.py`` measures it.

    Attributes:
        clip: Name in ``clips.RUNS``.
        runs: Folder of the results.
    """

    clip: str
    runs: Path = Path("runs/geometry")

    @property
    def name(self) -> str:
        """For messages and files."""
        return f"scene-{self.clip}"

    @property
    def result(self) -> Path:
        """The file."""
        return self.runs / "cases" / f"{self.name}.json"

    def measure(self) -> dict[str, Any]:
        """The row of ``clips.py``; a scene that is there counts."""
        return clips.measure(self.clip, clips.RUNS[self.clip], self.runs / "clips" / self.clip)


def everything(runs: Path, *, quick: bool = False) -> list[Measurement]:
    """All that is measured; ``quick`` a little of each table."""
    if quick:
        return list(_quick(runs))
    first = [*_ours(runs), MemoryRun(25, runs=runs), *_both("bend a", runs), *_backends(runs)]
    others = [*_graphs(runs, EASY), *_memory(runs), *_hard(runs), *_speed(runs), *_graphs(runs, APART)]
    upstream = [each for world in SEEDS for each in _both(world, runs)]
    scenes = [SceneRun(clip, runs) for clip in SCENES]
    return list(dict.fromkeys([*first, *others, *upstream, *scenes]))


def _quick(runs: Path) -> Iterator[Measurement]:
    for way in ("classical", "files"):
        yield BackendRun("street, static", way, runs)
    yield Alignment("bend a", "ours", 12, (96, 64), runs=runs)
    yield Alignment("bend a", PAPER, 12, (96, 64), runs=runs)
    yield Alignment("bend a", "upstream", 12, (96, 64), steps=FEW_STEPS, runs=runs)
    yield Alignment("bend a", "ours", 12, (96, 64), GRAPHS[0], runs=runs)
    yield MemoryRun(8, (128, 80), runs=runs)


def _ours(runs: Path) -> Iterator[Measurement]:
    for world in SEEDS:
        yield Alignment(world, "ours", runs=runs)


def _hard(runs: Path) -> Iterator[Measurement]:
    for world in SEEDS:
        yield Alignment(world, "ours", noise=HARD, runs=runs)


def _both(world: str, runs: Path) -> Iterator[Measurement]:
    """The authors' loss by our solver and by their program."""
    yield Alignment(world, PAPER, runs=runs)
    yield Alignment(world, "upstream", runs=runs)


def _memory(runs: Path) -> Iterator[Measurement]:
    for frames in MEMORY_FRAMES:
        yield MemoryRun(frames, graph=video_graph(frames), runs=runs)
    yield MemoryRun(64, graph=video_graph(64), dtype="float16", runs=runs)
    yield MemoryRun(128, graph="swin-2-noncyclic", dtype="float16", runs=runs)


def _backends(runs: Path) -> Iterator[Measurement]:
    for clip in (*RECORDINGS, *STREETS):
        for way in ("classical", "files"):
            yield BackendRun(clip, way, runs)


def _speed(runs: Path) -> Iterator[Measurement]:
    for size in SPEED_SIZES:
        steps = FEW_STEPS if size[0] * size[1] > WHOLE_PX else STEPS
        yield Alignment("bend a", PAPER, size=size, runs=runs)
        yield Alignment("bend a", "upstream", size=size, steps=steps, runs=runs)


def _graphs(runs: Path, noise: Noise) -> Iterator[Measurement]:
    for world in PATHS:
        for frames in (48, 24):
            for graph in (*GRAPHS, "complete") if frames == 24 else GRAPHS:
                yield Alignment(world, "ours", frames, graph=graph, noise=noise, runs=runs)
