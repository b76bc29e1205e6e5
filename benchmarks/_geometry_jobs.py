"""What the geometry benchmark measures, the most telling first."""

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import clips
from _geometry_alignment import EASY, GRAPH, GRAPHS, PAPER, STEPS, Alignment
from _geometry_backends import RECORDINGS, STREETS, UNCALIBRATED, BackendRun
from _geometry_cases import Measurement, Row, fields_of
from _geometry_worlds import SEEDS
from _simulated_pairs import Noise

from dreamdrive.geometry.backends.dust3r.align.alignment import AlignOptions

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
SCENES = ("pandaset-draft", "pandaset-files-draft", "pandaset-files-refined-draft")  # of clips.py
MEMORY_FRAMES = (8, 16, 32, 64, 128)
FULL_SIZE = (512, 288)


@dataclass(frozen=True)
class MemoryRun:
    """One alignment in a process of its own.

    Attributes:
        frames: Number of frames.
        size: Width and height in pixels.
        graph: Which pairs there are.
        dtype: Of the pointmaps.
        memory_gb: What is allowed, as a rule what ``generate`` allows.
        runs: Folder of the results.
    """

    frames: int
    size: tuple[int, int] = FULL_SIZE
    graph: str = GRAPH
    dtype: str = "float32"
    memory_gb: float = AlignOptions().memory_gb
    runs: Path = Path("runs/geometry")

    @property
    def name(self) -> str:
        """For messages and files."""
        size = f"{self.size[0]}x{self.size[1]}"
        return f"memory-{self.frames}-{size}-{self.graph}-{self.dtype}-{self.memory_gb:g}GB"

    @property
    def case(self) -> Row:
        """All that is above."""
        return fields_of(self)

    def measure(self) -> Row:
        """Bytes and seconds, or why it was refused."""
        program = Path(__file__).with_name("_geometry_memory.py")
        told = [self.frames, *self.size, self.graph, self.dtype, self.memory_gb]
        command = [sys.executable, str(program), *map(str, told)]
        return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


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
    def case(self) -> Row:
        """The name, and the command without the place of the data."""
        run = asdict(clips.RUNS[self.clip])
        options = [option.replace(str(clips.DATA), "DATA") for option in run["options"]]
        return {"clip": self.clip, "settings": {**run, "options": options}}

    def measure(self) -> Row:
        """The row of ``clips.py`` without its seconds, which are not those of all cores here.

        A scene that is there is deleted: ``generate`` would take its finished stages, of whichever code.
        """
        folder = self.runs / "clips" / self.clip
        if folder.exists():
            shutil.rmtree(folder)
        row = clips.measure(self.clip, clips.RUNS[self.clip], folder)
        return {name: value for name, value in row.items() if name not in ("seconds", "stages")}


def everything(runs: Path, *, quick: bool = False) -> list[Measurement]:
    """All that is measured; ``quick`` a little of each table."""
    if quick:
        return list(_quick(runs))
    first = [*_ours(runs, EASY), *_both("bend a", runs), *_backends(runs), *_memory(runs)]
    upstream = [each for world in SEEDS for each in _both(world, runs)]
    scenes = [SceneRun(clip, runs) for clip in SCENES]
    beside = [each for world in COMMON_BESIDE for each in _both(world, runs, COMMON)]
    others = [*_ours(runs, COMMON), *beside, *_speed(runs), *_graphs(runs), *_ours(runs, HARD)]
    hard = [each for world in SEEDS for each in _both(world, runs, HARD)]
    return list(dict.fromkeys([*first, *upstream, *scenes, *others, *hard]))


def _quick(runs: Path) -> Iterator[Measurement]:
    for way in ("classical", "files"):
        yield BackendRun("street, static", way, runs)
    yield Alignment("bend a", "ours", 12, (96, 64), runs=runs)
    yield Alignment("bend a", PAPER, 12, (96, 64), runs=runs)
    yield Alignment("bend a", "upstream", 12, (96, 64), steps=FEW_STEPS, runs=runs)
    yield Alignment("bend a", "ours", 12, (96, 64), "swin-2-noncyclic", runs=runs)
    yield MemoryRun(8, (128, 80), runs=runs)


def _ours(runs: Path, noise: Noise) -> Iterator[Measurement]:
    for world in SEEDS:
        yield Alignment(world, "ours", noise=noise, runs=runs)


def _both(world: str, runs: Path, noise: Noise = EASY) -> Iterator[Measurement]:
    """The authors' loss by our solver and by their program."""
    yield Alignment(world, PAPER, noise=noise, runs=runs)
    yield Alignment(world, "upstream", noise=noise, runs=runs)


def _memory(runs: Path) -> Iterator[Measurement]:
    """The size of a clip within 4 GB, one curve of one graph, and what other graphs and numbers change."""
    yield MemoryRun(25, memory_gb=4.0, runs=runs)
    for frames in MEMORY_FRAMES:
        yield MemoryRun(frames, runs=runs)
    yield MemoryRun(32, dtype="float16", runs=runs)
    yield MemoryRun(32, graph="logwin-5-noncyclic", runs=runs)
    yield MemoryRun(64, graph="logwin-5-noncyclic", memory_gb=4.0, runs=runs)  # refused
    yield MemoryRun(128, graph="logwin-5-noncyclic", runs=runs)  # refused


def _backends(runs: Path) -> Iterator[Measurement]:
    for clip in (*RECORDINGS, *STREETS):
        yield BackendRun(clip, "classical", runs)
        if clip != UNCALIBRATED:
            yield BackendRun(clip, "files", runs)


def _speed(runs: Path) -> Iterator[Measurement]:
    for size in SPEED_SIZES:
        steps = FEW_STEPS if size[0] * size[1] > WHOLE_PX else STEPS
        yield Alignment("bend a", "ours", size=size, runs=runs)
        yield Alignment("bend a", PAPER, size=size, runs=runs)
        yield Alignment("bend a", "upstream", size=size, steps=steps, runs=runs)


def _graphs(runs: Path) -> Iterator[Measurement]:
    for world in PATHS:
        for frames, graphs in GRAPHS.items():
            for graph in graphs:
                yield Alignment(world, "ours", frames, graph=graph, runs=runs)
    for frames in GRAPHS:
        for graph in CITED:
            for draw in range(1, DRAWS):
                yield Alignment(PATHS[0], "ours", frames, graph=graph, draw=draw, runs=runs)
    for world in PATHS:
        for graph in APART_GRAPHS:
            yield Alignment(world, "ours", LONG, graph=graph, noise=APART, runs=runs)
