"""One alignment of simulated pairs of a drawn street: by our solver, or as the authors' program does it."""

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from _geometry_worlds import SEEDS, world_of
from _simulated_pairs import Noise, Truth, pair_maps, truth_of
from jaxtyping import Float

from dreamdrive.evaluate.depth_errors import depth_errors, median_scale
from dreamdrive.evaluate.geometry import BANDS_M, STANDING_M
from dreamdrive.evaluate.paths import compare_paths
from dreamdrive.geometry.dust3r.align.alignment import AlignOptions, align
from dreamdrive.geometry.dust3r.align.graph import graph_of
from dreamdrive.geometry.dust3r.align.spanning_tree import spanning_tree
from dreamdrive.geometry.dust3r.pairmaps import PairMaps
from dreamdrive.geometry.dust3r.pairs import make_pairs
from dreamdrive.geometry.dust3r.reference.adam import descend
from dreamdrive.geometry.dust3r.reference.objective import Objective, raw_parameters
from dreamdrive.splat.torch_threads import one_torch_thread

RATE_HZ = 5.0
STEPS = 300
_FAR_M = BANDS_M[-1][1]  # depth beyond does not count

PAPER = "ours, paper's loss"
EASY = Noise(mistaken=False)
Method = Literal["ours", "ours, paper's loss", "upstream"]


@dataclass(frozen=True)
class Alignment:
    """A drive, what pairs say of it, and who aligns them.

    Attributes:
        world: Name in ``_geometry_worlds.SEEDS``.
        method: Our default; our solver with the authors' loss and freedom; or the authors' program.
        frames: Number of frames.
        size: Width and height in pixels.
        graph: Which pairs there are.
        noise: What is wrong with them.
        steps: Of Adam, the method ``upstream`` alone; fewer tell the seconds of one step.
        runs: Folder of the results.
    """

    world: str
    method: Method
    frames: int = 25
    size: tuple[int, int] = (128, 80)
    graph: str = "swin-3-noncyclic"
    noise: Noise = EASY
    steps: int = STEPS
    runs: Path = Path("runs/geometry")

    @property
    def name(self) -> str:
        """For messages and files."""
        size = "x".join(map(str, self.size))
        noise = ("-mistaken" if self.noise.mistaken else "") + (
            f"-unseen{self.noise.unseen:g}" if self.noise.unseen != 1 else ""
        )
        steps = f"-{self.steps}" if self.steps != STEPS else ""
        words = f"{self.world}-{self.method}-{self.frames}-{size}-{self.graph}{noise}{steps}"
        return "align-" + words.replace(" ", "_").replace(",", "").replace("'", "")

    @property
    def result(self) -> Path:
        """The file."""
        return self.runs / "cases" / f"{self.name}.json"

    def measure(self) -> dict[str, Any]:
        """The figures; seconds are the processor's, on one thread."""
        truth = truth_of(world_of(self.world, self.frames, RATE_HZ, self.size))
        edges = make_pairs(self.frames, self.graph)
        maps = pair_maps(truth, edges, self.noise, seed=100 * SEEDS[self.world] + self.frames)
        found = _upstream(maps, self.steps) if self.method == "upstream" else _ours(maps, self.method)
        told = {key: value for key, value in found.items() if key not in ("poses", "focals", "depth")}
        case = {key: value for key, value in asdict(self).items() if key != "runs"}
        errors = errors_of(found["poses"], found["focals"], found["depth"], truth)
        return {**case, "edges": len(edges), **errors, **told}


def _ours(maps: PairMaps, method: Method) -> dict[str, Any]:
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


def _upstream(maps: PairMaps, steps: int) -> dict[str, Any]:
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
