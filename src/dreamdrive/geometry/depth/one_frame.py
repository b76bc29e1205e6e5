"""Depth of one frame: plane sweep, ground prior and semi-global smoothing."""

from dataclasses import dataclass
from queue import SimpleQueue

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.compute.threads import THREADS
from dreamdrive.geometry.depth import smoothing, sweep
from dreamdrive.geometry.depth.view import PosedFrames, by_frame

PLANE_BONUS = 0.20
PLANE_MATCH_BONUS = 0.35
PLANE_MATCH = 0.6  # correlation under the plane's own warp from which the larger bonus counts
MIN_PLANE_INVERSE = 0.008  # 1/m; the road farther than 125 m away is a line


@dataclass(frozen=True)
class Swept:
    """What the sweep found for one frame.

    Inverse depth is in 1/m, 0 at infinity; ``correlation`` is its photometric support in [-1, 1]; on the
    plane it is the road plane's own.
    """

    inverse_depth: Float[np.ndarray, "h w"]
    correlation: Float[np.ndarray, "h w"]
    on_plane: Bool[np.ndarray, "h w"]


def sweep_frames(view: PosedFrames, sky: Bool[np.ndarray, "f h w"]) -> dict[int, Swept | None]:
    """Sweep every used frame against its sources; None for a frame that has none.

    Inverse depth 0 is rewarded in the sky (F, H, W).
    """
    _, height, width = view.grey.shape
    free: SimpleQueue[smoothing.CostBuffers] = SimpleQueue()
    for _ in range(THREADS):
        free.put(smoothing.CostBuffers(height, sweep.LABELS, width))

    def one(frame: int) -> Swept | None:
        work = free.get()
        try:
            return _sweep_frame(view, frame, sky[frame], work)
        finally:
            free.put(work)

    return by_frame(view, one)


def _sweep_frame(
    view: PosedFrames, frame: int, sky: Bool[np.ndarray, "h w"], work: smoothing.CostBuffers
) -> Swept | None:
    chosen = sweep.choose_sources(view.positions_m, view.used, frame, view.options.depth.reach_frames)
    if not chosen:
        return None
    sources = [
        (sweep.Warp(view.cameras[frame], view.cameras[i]), view.grey[i], view.usable[i]) for i in chosen
    ]
    correlation = sweep.Correlation(view.grey[frame])
    plane = view.plane_inverse[frame]
    plane_score = sweep.similarity(correlation, sources, plane)
    sweep.matching_cost(correlation, sources, work.cost)
    bonus = _plane_bonus(plane, plane_score)
    _add_at_plane(work.cost, plane, -bonus)
    work.cost[:, 0] -= sky
    label = smoothing.best_label(work, view.grey[frame])
    _add_at_plane(work.cost, plane, bonus)
    work.cost[:, 0] += sky
    return _read(label, work.cost, plane, plane_score)


def _plane_labels(plane: Float[np.ndarray, "h w"]) -> tuple[Bool[np.ndarray, "h w"], Int[np.ndarray, "h w"]]:
    """Where the road plane is within the sweep, and its nearest label."""
    reachable = (plane > MIN_PLANE_INVERSE) & (plane <= sweep.MAX_INVERSE_DEPTH)
    return reachable, sweep.nearest_label(plane)


def _plane_bonus(
    plane: Float[np.ndarray, "h w"], score: Float[np.ndarray, "h w"]
) -> Float[np.ndarray, "h w"]:
    """What the road's own label is favoured by; more where the picture warped by the plane matches."""
    bonus = PLANE_BONUS + np.where(score > PLANE_MATCH, PLANE_MATCH_BONUS * score, 0)
    return np.where(_plane_labels(plane)[0], bonus, 0).astype(np.float32)


def _add_at_plane(
    cost: Float[np.ndarray, "h labels w"], plane: Float[np.ndarray, "h w"], amount: Float[np.ndarray, "h w"]
) -> None:
    rows, columns = np.nonzero(amount)
    cost[rows, _plane_labels(plane)[1][rows, columns], columns] += amount[rows, columns]


def _read(
    label: Float[np.ndarray, "h w"],
    cost: Float[np.ndarray, "h labels w"],
    plane: Float[np.ndarray, "h w"],
    plane_score: Float[np.ndarray, "h w"],
) -> Swept:
    """Labels to inverse depth; where the road's label won, the plane's exact value."""
    step = sweep.MAX_INVERSE_DEPTH / (sweep.LABELS - 1)
    whole = np.rint(label).astype(np.intp)
    score = 1 - np.take_along_axis(cost, whole[:, None], axis=1)[:, 0]
    reachable, plane_label = _plane_labels(plane)
    on_plane = reachable & (whole == plane_label)
    return Swept(
        inverse_depth=np.where(on_plane, plane, label * step).astype(np.float32),
        correlation=np.where(on_plane, np.maximum(score, plane_score), score).astype(np.float32),
        on_plane=on_plane,
    )
