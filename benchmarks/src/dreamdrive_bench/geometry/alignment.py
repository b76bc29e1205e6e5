"""One alignment of simulated pairs of a drawn street: by our solver, or as the authors' program does it."""

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.evaluate import BANDS_M, STANDING_M, depth_errors, median_scale
from dreamdrive.geometry.backends.dust3r import PairMaps, make_pairs
from dreamdrive.geometry.backends.dust3r.align import AlignOptions, align, graph_of, spanning_tree
from dreamdrive.metrics.paths import compare_paths
from dreamdrive_bench.geometry.authors_alignment import Objective, descend, raw_parameters
from dreamdrive_bench.geometry.cases import Measurement, Row
from dreamdrive_bench.geometry.simulated_pairs import Noise, Truth, pair_maps, truth_of
from dreamdrive_bench.geometry.worlds import SEEDS, world_of

RATE_HZ = 5.0
STEPS = 300
_DRAWS = 10_000  # further apart than the seeds of all cases of one draw
_FAR_M = BANDS_M[-1][1]  # depth beyond does not count

GRAPH = "swin-3-noncyclic"
GRAPHS = {
    48: (GRAPH, "swin-5-noncyclic", "logwin-4-noncyclic", "logwin-5-noncyclic"),
    24: (GRAPH, "logwin-5-noncyclic", "complete"),
}
"""Which pairs are compared, by the number of frames; clips of these lengths are for nothing else."""
PAPER = "ours, paper's loss"
EASY = Noise(mistaken=False)
Method = Literal["ours", "ours, paper's loss", "upstream"]


@dataclass(frozen=True)
class Alignment(Measurement):
    """A drive, what pairs say of it, and who aligns them.

    Attributes:
        world: Name in ``geometry.worlds.SEEDS``.
        method: Our default; our solver with the authors' loss and freedom; or the authors' program.
        frames: Number of frames.
        size: Width and height in pixels.
        graph: Which pairs there are.
        noise: What is wrong with them.
        steps: Of Adam, the method ``upstream`` alone; fewer tell the seconds of one step.
        draw: Which draw of the noise.
    """

    world: str
    method: Method
    frames: int = 25
    size: tuple[int, int] = (128, 80)
    graph: str = GRAPH
    noise: Noise = EASY
    steps: int = STEPS
    draw: int = 0

    @property
    def name(self) -> str:
        """For messages and files."""
        size = "x".join(map(str, self.size))
        usual, own = asdict(EASY), asdict(self.noise)
        noise = "".join(f"-{name}{own[name]:g}" for name in own if own[name] != usual[name])
        steps = f"-{self.steps}" if self.steps != STEPS else ""
        draw = f"-draw{self.draw}" if self.draw else ""
        words = f"{self.world}-{self.method}-{self.frames}-{size}-{self.graph}{noise}{steps}{draw}"
        return "align-" + words.replace(" ", "_").replace(",", "").replace("'", "")

    def measure(self, runs: Path) -> Row:
        """The figures; seconds are the processor's, on one thread."""
        truth = drawn_truth(self.world, self.frames, self.size)
        edges = make_pairs(self.frames, self.graph)
        seed = _DRAWS * self.draw + 100 * SEEDS[self.world] + self.frames
        maps = pair_maps(truth, edges, self.noise, seed)
        found = _upstream(maps, self.steps) if self.method == "upstream" else _ours(maps, self.method)
        told = {key: value for key, value in found.items() if key not in ("poses", "focals", "depth")}
        errors = errors_of(found["poses"], found["focals"], found["depth"], truth)
        return {"edges": len(edges), **errors, **told}


def drawn_truth(world: str, frames: int, size: tuple[int, int]) -> Truth:
    """A drive on the rays that alignment takes: through pixel i from the left goes (i - W/2) / f.

    A drawn street has those through the middles of pixels, (i + 1/2 - W/2) / f. An alignment of its pointmaps
    would turn all cameras by half a pixel, which counts in the relative error of the path. Hence the picture
    is drawn a column and a row larger, and the last of both are left out: its pixel i has the ray
    (i + 1/2 - (W + 1)/2) / f.

    Args:
        world: Name in ``geometry.worlds.SEEDS``.
        frames: Number of frames.
        size: Width and height in pixels.
    """
    width, height = size
    drawn = truth_of(world_of(world, frames, RATE_HZ, (width + 1, height + 1)))
    labels = None if drawn.instance is None else drawn.instance[:, :height, :width]
    return replace(drawn, depth=drawn.depth[:, :height, :width], instance=labels, offset_px=0.0)


def _ours(maps: PairMaps, method: Method) -> Row:
    options = AlignOptions() if method == "ours" else AlignOptions(objective="distance", focal="each")
    began = time.process_time()
    found = align(maps, options)
    return {
        "seconds": time.process_time() - began,
        "poses": found.world_from_camera,
        "focals": found.focals_px,
        "depth": found.depth,
        "loss": found.loss,
        "path_observed": found.path_observed,
        "focal_observed": found.focal_observed,
    }


def _upstream(maps: PairMaps, steps: int) -> Row:
    """The authors' initialisation with its defects, their loss, Adam; a focal length for each image."""
    with one_torch_thread():
        began = time.process_time()
        raw = raw_parameters(spanning_tree(maps, upstream=True))
        objective = Objective(maps, graph_of(maps))
        start_s = time.process_time() - began
        if steps < STEPS:
            descend(objective, raw, 1, of=STEPS)  # the first step allocates, which would count a hundredfold
        began = time.process_time()
        descend(objective, raw, steps, of=STEPS)
        descent_s = time.process_time() - began
        end = objective.start_of(raw)
        loss = float(objective(raw).detach())
    return {
        "seconds": start_s + descent_s * STEPS / steps,
        "poses": end.world_from_camera,
        "focals": end.focals_px,
        "depth": end.depth,
        "loss": loss,
    }


def errors_of(
    poses: Float[np.ndarray, "n 4 4"],
    focals_px: Float[np.ndarray, " n"],
    depth: Sequence[Float[np.ndarray, "h w"]],
    truth: Truth,
) -> dict[str, float | None]:
    """Errors of path, focal length and depth in per cent or as shares; None where the camera stands still."""
    true = truth.world_from_camera
    stands = np.linalg.norm(true[:, :3, 3] - true[0, :3, 3], axis=1).max() <= STANDING_M
    path = None if stands else compare_paths(poses, true)
    seen = (truth.depth > 0) & (truth.depth <= _FAR_M)
    d, t = np.stack(depth)[seen], truth.depth[seen]
    scale = median_scale(d, t)
    off = None if scale is None else depth_errors(scale * d, t)
    return {
        "path_percent": path and path.ate_percent,
        "rpe_percent": path and path.translation_percent,
        "focal_percent": float(100 * np.abs(focals_px / truth.focal_px - 1).max()),
        "abs_rel": off and off.abs_rel,
        "delta_1": off and off.delta_1,
    }
