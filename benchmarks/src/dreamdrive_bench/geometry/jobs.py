"""What the geometry benchmark measures, the most telling first."""

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from dreamdrive.geometry.backends.dust3r.align import AlignOptions
from dreamdrive_bench import clips
from dreamdrive_bench.geometry.alignment import EASY, GRAPH, GRAPHS, PAPER, STEPS, Alignment
from dreamdrive_bench.geometry.backends import RECORDINGS, STREETS, UNCALIBRATED, BackendRun
from dreamdrive_bench.geometry.cases import Measurement, Row
from dreamdrive_bench.geometry.simulated_pairs import Noise
from dreamdrive_bench.geometry.worlds import SEEDS

HARD = Noise(mistaken=True)
APART = Noise(mistaken=False, unseen=3)
COMMON = Noise(mistaken=False, common_focal=0.05, place=0.01)
COMMON_BESIDE = ("bend a", "corner a")  # the authors' program keeps such a focal length: two worlds show it
PATHS, LONG = ("bend a", "corner a"), 48  # worlds and frames of the choice of graph
APART_GRAPHS = (GRAPH, "swin-5-noncyclic", "logwin-5-noncyclic")
CITED = (
    GRAPH,
    "logwin-5-noncyclic",
)  # in dreamdrive.geometry.backends.dust3r.pairs.video_graph, of the first path
DRAWS = 3  # of the noise, of those
SPEED_SIZES = ((96, 64), (128, 80), (192, 112), (512, 288))
WHOLE_PX = 192 * 112  # sizes beyond: a few steps of Adam tell the seconds of all
FEW_STEPS = 3
SCENES = ("pandaset-draft", "pandaset-files-draft", "pandaset-files-refined-draft")  # of the command clips
MEMORY_FRAMES = (8, 16, 32, 64, 128)
FULL_SIZE = (512, 288)


@dataclass(frozen=True)
class MemoryRun(Measurement):
    """One alignment in a process of its own.

    Attributes:
        frames: Number of frames.
        size: Width and height in pixels.
        graph: Which pairs there are.
        dtype: Of the pointmaps.
        memory_gb: What is allowed, as a rule what ``generate`` allows.
    """

    frames: int
    size: tuple[int, int] = FULL_SIZE
    graph: str = GRAPH
    dtype: str = "float32"
    memory_gb: float = AlignOptions().memory_gb

    @property
    def name(self) -> str:
        """For messages and files."""
        size = f"{self.size[0]}x{self.size[1]}"
        return f"memory-{self.frames}-{size}-{self.graph}-{self.dtype}-{self.memory_gb:g}GB"

    def measure(self, runs: Path) -> Row:
        """Bytes and seconds, or why it was refused."""
        told = [self.frames, *self.size, self.graph, self.dtype, self.memory_gb]
        command = [sys.executable, "-m", "dreamdrive_bench.geometry.memory_run", *map(str, told)]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE)
        return json.loads(done.stdout)


@dataclass(frozen=True)
class SceneRun(Measurement):
    """A clip through ``dreamdrive generate``, as ``clips`` measures it.

    Attributes:
        clip: Name in ``clips.RUNS``.
    """

    clip: str

    @property
    def name(self) -> str:
        """For messages and files."""
        return f"scene-{self.clip}"

    @property
    def case(self) -> Row:
        """The name, and the command without the place of the data."""
        run = asdict(clips.RUNS[self.clip])
        options = [option.replace(str(clips.DATA), "DATA") for option in run["options"]]
        return {"clip": self.clip, "settings": {**run, "options": options}}

    def measure(self, runs: Path) -> Row:
        """The row of ``clips`` without its seconds, which are not those of all cores here.

        A scene that is there is deleted: ``generate`` would take its finished stages, of whichever code.
        """
        folder = runs / "clips" / self.clip
        if folder.exists():
            shutil.rmtree(folder)
        row = clips.measure(self.clip, clips.RUNS[self.clip], folder)
        return {name: value for name, value in row.items() if name not in ("seconds", "stages")}


def everything(*, quick: bool = False) -> list[Measurement]:
    """All that is measured; ``quick`` a little of each table."""
    if quick:
        return list(_quick())
    first = [*_ours(EASY), *_both("bend a"), *_backends(), *_memory()]
    upstream = [each for world in SEEDS for each in _both(world)]
    scenes = [SceneRun(clip) for clip in SCENES]
    beside = [each for world in COMMON_BESIDE for each in _both(world, COMMON)]
    others = [*_ours(COMMON), *beside, *_speed(), *_graphs(), *_ours(HARD)]
    hard = [each for world in SEEDS for each in _both(world, HARD)]
    return list(dict.fromkeys([*first, *upstream, *scenes, *others, *hard]))


def _quick() -> Iterator[Measurement]:
    for way in ("classical", "files"):
        yield BackendRun("street, static", way)
    yield Alignment("bend a", "ours", 12, (96, 64))
    yield Alignment("bend a", PAPER, 12, (96, 64))
    yield Alignment("bend a", "upstream", 12, (96, 64), steps=FEW_STEPS)
    yield Alignment("bend a", "ours", 12, (96, 64), "swin-2-noncyclic")
    yield MemoryRun(8, (128, 80))


def _ours(noise: Noise) -> Iterator[Measurement]:
    for world in SEEDS:
        yield Alignment(world, "ours", noise=noise)


def _both(world: str, noise: Noise = EASY) -> Iterator[Measurement]:
    """The authors' loss by our solver and by their program."""
    yield Alignment(world, PAPER, noise=noise)
    yield Alignment(world, "upstream", noise=noise)


def _memory() -> Iterator[Measurement]:
    """The size of a clip within 4 GB, one curve of one graph, and what other graphs and numbers change."""
    yield MemoryRun(25, memory_gb=4.0)
    for frames in MEMORY_FRAMES:
        yield MemoryRun(frames)
    yield MemoryRun(32, dtype="float16")
    yield MemoryRun(32, graph="logwin-5-noncyclic")
    yield MemoryRun(64, graph="logwin-5-noncyclic", memory_gb=4.0)  # refused
    yield MemoryRun(128, graph="logwin-5-noncyclic")  # refused


def _backends() -> Iterator[Measurement]:
    for clip in (*RECORDINGS, *STREETS):
        yield BackendRun(clip, "classical")
        if clip != UNCALIBRATED:
            yield BackendRun(clip, "files")


def _speed() -> Iterator[Measurement]:
    for size in SPEED_SIZES:
        steps = FEW_STEPS if size[0] * size[1] > WHOLE_PX else STEPS
        yield Alignment("bend a", "ours", size=size)
        yield Alignment("bend a", PAPER, size=size)
        yield Alignment("bend a", "upstream", size=size, steps=steps)


def _graphs() -> Iterator[Measurement]:
    for world in PATHS:
        for frames, graphs in GRAPHS.items():
            for graph in graphs:
                yield Alignment(world, "ours", frames, graph=graph)
    for frames in GRAPHS:
        for graph in CITED:
            for draw in range(1, DRAWS):
                yield Alignment(PATHS[0], "ours", frames, graph=graph, draw=draw)
    for world in PATHS:
        for graph in APART_GRAPHS:
            yield Alignment(world, "ours", LONG, graph=graph, noise=APART)
