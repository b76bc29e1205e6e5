"""Depth of one frame: plane sweep, ground prior and semi-global smoothing."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.classical import smoothing, sweep
from dreamdrive.geometry.classical.view import View

_PLANE_BONUS = 0.20
_PLANE_MATCH_BONUS = 0.35
_PLANE_MATCH = 0.6  # correlation under the plane's own warp from which the larger bonus counts
_MIN_PLANE_INVERSE = 0.008  # 1/m; the road farther than 125 m away is a line


@dataclass(frozen=True)
class Swept:
    """What the sweep found for one frame.

    Attributes:
        inverse_depth: In 1/m (H, W); 0 at infinity.
        correlation: Photometric support of it (H, W) in [-1, 1].
        on_plane: Pixels whose inverse depth is the road plane's own (H, W).
    """

    inverse_depth: Float[np.ndarray, "h w"]
    correlation: Float[np.ndarray, "h w"]
    on_plane: Bool[np.ndarray, "h w"]


def sweep_frame(view: View, frame: int, sky: Bool[np.ndarray, "h w"]) -> Swept | None:
    """Sweep one frame against its sources; None when it has none. Inverse depth 0 is rewarded in the sky."""
    chosen = sweep.choose_sources(view.positions_m, view.used, frame)
    if not chosen:
        return None
    sources = [
        (sweep.Warp(view.cameras[frame], view.cameras[i]), view.grey[i], view.usable[i]) for i in chosen
    ]
    correlation = sweep.Correlation(view.grey[frame])
    volume = sweep.matching_volume(correlation, sources)
    plane_score = sweep.similarity(correlation, sources, view.plane_inverse[frame])
    cost = 1 - volume
    _reward_plane(cost, view.plane_inverse[frame], plane_score)
    cost[:, 0][sky] -= 1
    label = smoothing.best_label(smoothing.semi_global(cost, view.grey[frame]))
    return _read(label, volume, view.plane_inverse[frame], plane_score)


def _plane_labels(
    plane_inverse: Float[np.ndarray, "h w"],
) -> tuple[Bool[np.ndarray, "h w"], np.ndarray]:
    reachable = (plane_inverse > _MIN_PLANE_INVERSE) & (plane_inverse <= sweep.MAX_INVERSE_DEPTH)
    return reachable, sweep.nearest_label(plane_inverse)


def _reward_plane(
    cost: Float[np.ndarray, "h labels w"],
    plane_inverse: Float[np.ndarray, "h w"],
    score: Float[np.ndarray, "h w"],
) -> None:
    """Lower, in place, the cost of the road's own label."""
    reachable, label = _plane_labels(plane_inverse)
    bonus = _PLANE_BONUS + np.where(score > _PLANE_MATCH, _PLANE_MATCH_BONUS * score, 0)
    rows, columns = np.nonzero(reachable)
    cost[rows, label[reachable], columns] -= bonus[reachable]


def _read(
    label: Float[np.ndarray, "h w"],
    volume: Float[np.ndarray, "h labels w"],
    plane_inverse: Float[np.ndarray, "h w"],
    plane_score: Float[np.ndarray, "h w"],
) -> Swept:
    """Labels to inverse depth; where the road's label won, the plane's exact value."""
    step = sweep.MAX_INVERSE_DEPTH / (sweep.LABELS - 1)
    whole = np.rint(label).astype(np.intp)
    score = np.take_along_axis(volume, whole[:, None], axis=1)[:, 0]
    reachable, plane_label = _plane_labels(plane_inverse)
    on_plane = reachable & (whole == plane_label)
    return Swept(
        inverse_depth=np.where(on_plane, plane_inverse, label * step).astype(np.float32),
        correlation=np.where(on_plane, np.maximum(score, plane_score), score).astype(np.float32),
        on_plane=on_plane,
    )
