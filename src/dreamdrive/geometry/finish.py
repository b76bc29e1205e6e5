"""The way from measured cameras and depth to metres, road, sky and what moves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.geometry.cameras import as_posed, contradiction, rebase, stands, without_poses
from dreamdrive.geometry.dense import densify
from dreamdrive.geometry.evidence import Evidence, observe
from dreamdrive.geometry.measured import Measured
from dreamdrive.geometry.options import GeometryOptions
from dreamdrive.geometry.road import MIN_RATIOS, Metric, PosedClip, depth_points, in_metres, scale as scales
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Geometry, Ground, Scale

_MEDIAN_DEPTH_M = 12.0  # of a street seen from a car; makes "near" a word before the metre is known
_ALIKE = 1.0  # grey levels
_STANDING = "the camera stands still: its path is noise and not used"


def begin(clip: Clip, backend: str, weights: Path | None) -> tuple[Path, Evidence, Clip]:
    """The weights of a network, what the frames show without it, and the clip as it is to be measured.

    Of a standing camera the path is noise, in which no unit can be read: it is measured without known poses.

    Raises:
        InputError: No weights, fewer than two frames, frames that are all alike, or known poses that
            contradict them.
    """
    if weights is None:
        raise InputError(f"geometry {backend} needs the weights of its network")
    check_frames(clip, backend)
    evidence = observe(clip)
    contradiction.check(clip, evidence)
    return weights, evidence, without_poses(clip) if stands(clip, evidence) else clip


def check_frames(clip: Clip, backend: str) -> None:
    """Refuse what no network can find cameras in."""
    if len(clip) < 2:
        raise InputError(f"geometry {backend} takes two frames or more; got {len(clip)}")
    first = clip.frames[0].astype(np.int16)
    if all(float(np.abs(frame - first).mean()) < _ALIKE for frame in clip.frames[1:]):
        raise InputError(
            f"geometry {backend}: all {len(clip)} frames are alike, which shows neither path nor depth; "
            "take frames between which the camera moves"
        )


def finish(
    clip: Clip,
    measured: Measured,
    evidence: Evidence,
    options: GeometryOptions = GeometryOptions(),
    *,
    seed: int = 0,
) -> Geometry:
    """Bring what was measured to metres and find road, sky and what moves, as for any clip.

    The metre comes from the unit where that is one, else from known depth in metres, else from the height of
    the camera above the road, by default 1.5 m. Of a clip that stands still the measured path is noise: all
    frames get one place, or the known ones where these are in metres.
    """
    still = stands(clip, evidence)
    factor = 1.0 if measured.unit is not None else _rough_factor(measured)
    poses = np.tile(np.eye(4), (len(clip), 1, 1)) if still else measured.world_from_camera.astype(np.float64)
    poses[:, :3, 3] *= factor
    metric = _metric(clip, measured, evidence, poses, factor, options.camera_height_m, seed)
    metres = factor * metric.factor
    poses, _ = rebase(poses, np.zeros((0, 3)))
    poses[:, :3, 3] *= metric.factor
    notes = [*measured.notes, *metric.notes]
    if still:
        notes.append(_STANDING)
        known = clip.known.world_from_camera
        if known is not None and clip.known.metric:
            poses, _ = rebase(known.astype(np.float64), np.zeros((0, 3)))
        elif known is not None:
            notes.append("the given poses and depth, in an unknown unit, are not used")
    others = {name: metres_in_one / metres for name, metres_in_one in measured.others.items()}
    metric = replace(metric, scale=replace(metric.scale, others={**metric.scale.others, **others}))
    # Of a standing clip it is not that of the poses, as which others read it.
    details = measured.details if still else {**measured.details, "metres_per_unit": metres}
    posed = as_posed(clip, evidence, poses, measured.camera, metric, measured.focal_observed, notes, details)
    posed = replace(posed, standing=still, metres_per_unit=None if still else metres)
    depth_m = (measured.depth * np.float32(metres)).astype(np.float32)
    known = in_metres(clip, _of_known(clip, metres, still))
    return densify(known, posed, options, (depth_m, measured.confidence))


def _rough_factor(measured: Measured) -> float:
    depth = measured.depth[measured.depth > 0]
    return _MEDIAN_DEPTH_M / float(np.median(depth)) if len(depth) else 1.0


def _of_known(clip: Clip, metres: float, still: bool) -> float | None:
    """What makes metres of known depth; None where nothing does.

    Of an unknown unit it shares that of the known poses, which is that of what was measured unless the camera
    stands.
    """
    if clip.known.metric:
        return 1.0
    return None if still or clip.known.world_from_camera is None else metres


def _metric(
    clip: Clip,
    measured: Measured,
    evidence: Evidence,
    poses: Float[np.ndarray, "f 4 4"],
    factor: float,
    height_m: float | None,
    seed: int,
) -> Metric:
    """Scale and road of the poses, which are in metres or roughly so."""
    known = Known(poses, True, (measured.depth * np.float32(factor)).astype(np.float32))
    points = depth_points(replace(clip, rig=(measured.camera,), known=known))
    poses, points = rebase(poses, points)
    street = PosedClip.of(clip, evidence, measured.camera, poses, points)
    if clip.known.ground is not None and clip.known.world_from_camera is not None and clip.known.metric:
        return _over(clip.known.ground.seen_from(clip.known.world_from_camera[0]), street, measured, seed)
    if measured.unit is not None:
        return scales.as_given(street, measured.unit, measured.unit_spread, measured.unit, height_m, seed)
    ratios = _ratios(clip, measured, factor)
    if len(ratios) >= MIN_RATIOS:
        return scales.from_depth(ratios, street, height_m, seed)
    slow = scales.median_speed(street) < scales.SPEEDS_M_S[0]
    seen = _in_place(street) if slow else street
    found = scales.from_road_points(seen, height_m, _focal_spread(measured), seed)
    if found is not None:
        return found
    if slow:
        return _by_median_depth()
    return scales.from_ground(street, height_m, _focal_spread(measured), seed)


def _focal_spread(measured: Measured) -> float:
    if measured.focal_spread is not None:
        return measured.focal_spread
    return scales.focal_spread_of(measured.focal_observed)


def _in_place(street: PosedClip) -> PosedClip:
    """As if the camera only turned: steps that are noise would say that up is anywhere."""
    poses = street.world_from_camera.copy()
    poses[:, :3, 3] = 0
    return replace(street, world_from_camera=poses)


def _over(ground: Ground, street: PosedClip, measured: Measured, seed: int) -> Metric:
    """Over a known road: the height of the camera above it tells metres where the unit does not."""
    if measured.unit is not None:
        return Metric(1.0, ground, Scale(measured.unit, measured.unit_spread), ())
    found = scales.from_road_points(street, ground.offset_m, _focal_spread(measured), seed)
    return replace(found or _by_median_depth(), ground=ground)


def _ratios(clip: Clip, measured: Measured, factor: float) -> Float[np.ndarray, " n"]:
    """Known depth in metres over measured depth times ``factor``, where both are."""
    known = clip.known.depth_m
    if known is None or not clip.known.metric:
        return np.zeros(0)
    both = (known > 0) & (measured.depth > 0) & ~clip.held_out[:, None, None]
    return known[both].astype(np.float64) / (factor * measured.depth[both])


def _by_median_depth() -> Metric:
    """The rough factor, where the path is none and no road was seen."""
    problem = "no road plane was found, and the path shows no speed"
    words = f"a median depth of {_MEDIAN_DEPTH_M:.0f} m is assumed"
    scale = Scale(f"none: {problem}; {words}", scales.SPEED_SPREAD, basis="usual depth")
    return Metric(1.0, None, scale, (f"{problem}: {words}",))
