"""Errors of a scene's cameras and depth against known poses and lidar or exact depth."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import rankdata

from dreamdrive.errors import InputError
from dreamdrive.evaluate.estimate import Estimate
from dreamdrive.evaluate.truth.geometry import GeometryTruth
from dreamdrive.metrics.paths import PathError, compare_paths

BANDS_M = ((0.0, 10.0), (10.0, 20.0), (20.0, 40.0), (40.0, 80.0))
"""Bands of true depth; the far end belongs to a band, the near end does not. Nothing beyond counts."""
STANDING_M = 0.5
"""A true path that nowhere leads further than this from its start is that of a standing camera."""
SHARES = (0.25, 0.5, 0.75, 1.0)
"""Shares of the pixels, the most trusted first, over which the error is averaged."""
_DELTA = 1.25


@dataclass(frozen=True)
class DepthErrors:
    """Means over pixels, by the definitions of Eigen et al. 2014; d is the depth found, t the true one.

    Attributes:
        pixels: Number of pixels.
        abs_rel: Mean of |d - t| / t.
        sq_rel_m: Mean of (d - t)^2 / t in metres.
        rmse_m: Root mean square of d - t in metres.
        rmse_log: Root mean square of ln d - ln t.
        delta_1: Share with max(d / t, t / d) below 1.25; a pixel at the limit does not count.
        delta_2: The same below 1.25^2.
        delta_3: The same below 1.25^3.
    """

    pixels: int
    abs_rel: float
    sq_rel_m: float
    rmse_m: float
    rmse_log: float
    delta_1: float
    delta_2: float
    delta_3: float


@dataclass(frozen=True)
class Trust:
    """Whether the most trusted pixels are the most right ones.

    Attributes:
        pixels: Number of pixels.
        shares: Shares of the pixels, the most trusted first.
        abs_rel: Mean of |d - t| / t over each share.
        rank_correlation: Spearman's, between the confidence and minus that error: 1 where the more trusted of
            two pixels is always the more right, 0 where confidence says nothing, below 0 where it misleads;
            None where either is the same in all pixels.
    """

    pixels: int
    shares: tuple[float, ...]
    abs_rel: tuple[float, ...]
    rank_correlation: float | None


@dataclass(frozen=True)
class ScaleError:
    """The size of the scene as its path shows it.

    Attributes:
        metres_per_unit: True metres for a unit of length of the scene.
        error_percent: How much too long the scene's lengths are where its unit is taken for a metre.
    """

    metres_per_unit: float
    error_percent: float


@dataclass(frozen=True)
class PinholeError:
    """The pinhole of the scene, at the size of its frames.

    Attributes:
        focal_px: Focal length of the scene, the geometric mean of both axes.
        true_focal_px: The same of the truth.
        focal_percent: How much too long it is.
        principal_px: Distance of the principal points.
        observed: Whether the focal length was calibrated or shown by the clip, rather than guessed; None
            where that was not kept.
    """

    focal_px: float
    true_focal_px: float
    focal_percent: float
    principal_px: float
    observed: bool | None


@dataclass(frozen=True)
class DepthGroup:
    """Pixels of a kind, and how far their depth is off at three scales.

    Attributes:
        name: ``"all"``, ``"static"``, ``"moving"``, or a band of true depth such as ``"10-20 m"``.
        true: Pixels with known depth.
        coverage: Share of them that have any depth in the scene; None where there are none.
        as_is: Errors with the scene's unit taken for a metre; None where no pixel has both depths.
        path_scale: Errors after the scale of the path; None where the path shows no scale, too.
        median_scale: Errors after the median scale of all pixels of the clip.
    """

    name: str
    true: int
    coverage: float | None
    as_is: DepthErrors | None
    path_scale: DepthErrors | None
    median_scale: DepthErrors | None


@dataclass(frozen=True)
class DepthFigures:
    """Depth of the frames that have any and whose truth has some.

    Attributes:
        frames: Number of frames.
        median_scale: Median of true depth over depth found, of all pixels; None where none has both.
        groups: All pixels, static and moving ones where the truth tells them apart, and bands of depth.
        trust: What the confidence is worth, after the median scale.
    """

    frames: int
    median_scale: float | None
    groups: tuple[DepthGroup, ...]
    trust: Trust | None


@dataclass(frozen=True)
class GeometryFigures:
    """Figures of one scene; see docs/reference/evaluate_geometry.md for what they tell.

    Attributes:
        frames: Number of frames, all of which count for the path.
        width_px: Width of the frames, on which figures in pixels depend.
        path_m: Length of the true path.
        path: The path against the true one; None where the true camera stands still.
        scale: The scale of the path; None where either camera stands still.
        scale_source: What fixed the scale of the scene, in words; None where that was not kept.
        pinhole: Focal length and principal point; None where the truth has no calibration.
        depth: Depth; None where scene and truth have no frame with depth in common.
        notes: What else to know, a sentence each.
    """

    frames: int
    width_px: int
    path_m: float
    path: PathError | None
    scale: ScaleError | None
    scale_source: str | None
    pinhole: PinholeError | None
    depth: DepthFigures | None
    notes: tuple[str, ...]


def evaluate_geometry(estimate: Estimate, truth: GeometryTruth) -> GeometryFigures:
    """Measure how good cameras and depth are, against the truth of the same frames on the same pixels.

    Raises:
        InputError: The numbers of frames or their sizes differ.
    """
    _check(estimate, truth)
    found, true = (np.stack([c.world_from_camera for c in x.cameras]) for x in (estimate, truth))
    path = None if _stands(true) else compare_paths(found, true)
    scale = None
    if path is not None and path.scale > 0 and np.ptp(found[:, :3, 3], axis=0).max() > 0:
        scale = ScaleError(path.scale, 100 / path.scale - 100)
    depth = _depth(estimate, truth, scale)
    return GeometryFigures(
        frames=len(found),
        width_px=estimate.size[0],
        path_m=float(np.linalg.norm(np.diff(true[:, :3, 3], axis=0), axis=1).sum()),
        path=path,
        scale=scale,
        scale_source=estimate.scale and estimate.scale.source,
        pinhole=_pinhole(estimate, truth) if truth.calibrated else None,
        depth=depth,
        notes=(*truth.notes, *_notes(estimate, truth, path, scale, depth)),
    )


def _check(estimate: Estimate, truth: GeometryTruth) -> None:
    if len(estimate.cameras) != len(truth.cameras):
        raise InputError(
            f"the scene has {len(estimate.cameras)} frames but the truth has {len(truth.cameras)}; "
            "give the truth of the recording that the scene was made from"
        )
    size = truth.cameras[0].width_px, truth.cameras[0].height_px
    if estimate.size != size:
        raise InputError(
            f"the scene's frames are {estimate.size[0]}x{estimate.size[1]}, those of the truth "
            f"{size[0]}x{size[1]}; expected the truth on the pixels of the scene"
        )


def _stands(poses: Float[np.ndarray, "f 4 4"]) -> bool:
    return bool(np.linalg.norm(poses[:, :3, 3] - poses[0, :3, 3], axis=1).max() <= STANDING_M)


def _pinhole(estimate: Estimate, truth: GeometryTruth) -> PinholeError:
    """Means over the frames, which as a rule share one pinhole."""
    focals = (np.mean([np.sqrt(c.fx_px * c.fy_px) for c in x.cameras]) for x in (estimate, truth))
    pairs = zip(estimate.cameras, truth.cameras, strict=True)
    apart = float(np.mean([np.hypot(a.cx_px - b.cx_px, a.cy_px - b.cy_px) for a, b in pairs]))
    focal_px, true_px = map(float, focals)
    return PinholeError(focal_px, true_px, 100 * focal_px / true_px - 100, apart, estimate.focal_observed)


def _depth(estimate: Estimate, truth: GeometryTruth, scale: ScaleError | None) -> DepthFigures | None:
    """Errors of all pixels with true depth, in the frames that are not held out."""
    if estimate.depth_m is None:
        return None
    known = (truth.depth_m > 0) & (truth.depth_m <= BANDS_M[-1][1]) & ~estimate.held_out[:, None, None]
    if not known.any():
        return None
    found, true = estimate.depth_m[known].astype(np.float64), truth.depth_m[known].astype(np.float64)
    has = found > 0
    middle = median_scale(found[has], true[has])
    scales = 1.0, scale and scale.metres_per_unit, middle
    groups = [_group("all", np.ones(len(true), dtype=bool), found, true, scales)]
    if truth.moving is not None:
        moving = truth.moving[known]
        groups += [_group(n, m, found, true, scales) for n, m in (("static", ~moving), ("moving", moving))]
    for near_m, far_m in BANDS_M:
        inside = (true > near_m) & (true <= far_m)
        groups.append(_group(f"{near_m:.0f}-{far_m:.0f} m", inside, found, true, scales))
    confident = None
    if estimate.confidence is not None and middle is not None:
        confident = trust(middle * found[has], true[has], estimate.confidence[known][has])
    return DepthFigures(int(known.any(axis=(1, 2)).sum()), middle, tuple(groups), confident)


def _group(
    name: str,
    members: Bool[np.ndarray, " n"],
    found: Float[np.ndarray, " n"],
    true: Float[np.ndarray, " n"],
    scales: tuple[float | None, float | None, float | None],
) -> DepthGroup:
    """One kind of pixels; ``found`` is 0 where the scene has no depth."""
    count, both = int(members.sum()), members & (found > 0)
    as_is, path, median = (None if s is None else depth_errors(s * found[both], true[both]) for s in scales)
    return DepthGroup(name, count, float(both.sum() / count) if count else None, as_is, path, median)


def depth_errors(found: Float[np.ndarray, " n"], true: Float[np.ndarray, " n"]) -> DepthErrors | None:
    """The errors of positive depths (N,), both in metres; None for no pixels."""
    if not len(true):
        return None
    d, t = _positive(found), _positive(true)
    ratio, log = np.maximum(d / t, t / d), np.log(d) - np.log(t)
    return DepthErrors(
        pixels=len(t),
        abs_rel=float((np.abs(d - t) / t).mean()),
        sq_rel_m=float((np.square(d - t) / t).mean()),
        rmse_m=float(np.sqrt(np.square(d - t).mean())),
        rmse_log=float(np.sqrt(np.square(log).mean())),
        delta_1=float((ratio < _DELTA).mean()),
        delta_2=float((ratio < _DELTA**2).mean()),
        delta_3=float((ratio < _DELTA**3).mean()),
    )


def median_scale(found: Float[np.ndarray, " n"], true: Float[np.ndarray, " n"]) -> float | None:
    """The median of true depth over depth found, of positive depths (N,); None for no pixels."""
    return float(np.median(_positive(true) / _positive(found))) if len(true) else None


def trust(
    found: Float[np.ndarray, " n"], true: Float[np.ndarray, " n"], confidence: Float[np.ndarray, " n"]
) -> Trust | None:
    """Compare confidence with the errors of positive depths (N,); None for no pixels.

    Pixels of equal confidence count with their common mean error: which of them a share takes is no one's
    choice, and the order of the pixels does not matter.
    """
    if not len(true):
        return None
    error = np.abs(_positive(found) - _positive(true)) / _positive(true)
    _, level, count = np.unique(-confidence.astype(np.float64), return_inverse=True, return_counts=True)
    summed = np.concatenate([[0.0], np.cumsum(np.bincount(level, weights=error))])
    taken = np.concatenate([[0], np.cumsum(count)])
    wanted = np.array(SHARES) * len(error)
    means = np.interp(wanted, taken, summed) / wanted
    correlation = _rank_correlation(confidence, -error)
    return Trust(len(error), SHARES, tuple(means.tolist()), correlation)


def _positive(depth: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    if not (np.isfinite(depth) & (depth > 0)).all():
        raise ValueError("depth errors: expected positive, finite depths; leave out pixels without depth")
    return depth.astype(np.float64)


def _rank_correlation(a: Float[np.ndarray, " n"], b: Float[np.ndarray, " n"]) -> float | None:
    """Spearman's rank correlation, equal values at their mean rank."""
    if np.ptp(a) == 0 or np.ptp(b) == 0:
        return None
    return float(np.corrcoef(rankdata(a), rankdata(b))[0, 1])


def _notes(
    estimate: Estimate,
    truth: GeometryTruth,
    path: PathError | None,
    scale: ScaleError | None,
    depth: DepthFigures | None,
) -> list[str]:
    """What has no meaning here, and why."""
    notes: list[str] = []
    if path is None:
        notes.append(
            f"The true camera stands still (within {STANDING_M:g} m): its path tells no errors and no scale."
        )
    elif scale is None:
        notes.append("The scene's camera stands still though the true one drives: its path shows no scale.")
    elif len(estimate.cameras) == 2:
        notes.append("Two positions always fit: with two frames the distance (ATE) tells nothing.")
    if estimate.scale is not None and not np.isfinite(estimate.scale.spread):
        notes.append(
            "Nothing fixed the scene's scale: errors with its unit taken for a metre are those of the guess."
        )
    if not truth.calibrated:
        notes.append("The truth has no calibration: focal length and principal point were not compared.")
    if estimate.depth_m is not None and depth is None:
        notes.append("No frame with depth in the scene has true depth within 80 m: depth was not compared.")
    if depth is not None and truth.moving is None:
        notes.append("The truth does not say what moves: moving pixels count with the others.")
    if depth is not None and estimate.held_out.any():
        held_out = int(estimate.held_out.sum())
        notes.append(f"Held-out frames ({held_out}) have poses and no depth: the path alone counts them.")
    return notes
