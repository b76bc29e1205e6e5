"""Cameras of a clip: the order of work from known poses over structure from motion to the fallback."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.errors import InputError
from dreamdrive.geometry.cameras import contradiction, odometry, turning
from dreamdrive.geometry.cameras.calm import calm_path
from dreamdrive.geometry.cameras.mapping import MappingOutcome, reconstruct
from dreamdrive.geometry.cameras.paths import fill, path_length, rebase
from dreamdrive.geometry.depth import Tell, unheard
from dreamdrive.geometry.evidence import Evidence, observe
from dreamdrive.geometry.options import GeometryOptions
from dreamdrive.geometry.road import Metric, PosedClip, depth_points, depth_ratios, scale
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Fallback, Focal, Ground, Scale

MIN_TRACKS = 10
FALLBACK_SPREAD, STANDING_SPREAD = 0.35, 0.5


@dataclass(frozen=True)
class Posed:
    """A clip with cameras, in metres, in the frame of the first camera.

    Attributes:
        cameras: One posed pinhole a frame.
        fixed_regions: 0 for the street, else 1 + index into ``region_names`` (H, W).
        region_names: Names of what is fixed to the camera.
        ground: The road plane, where found.
        scale: What fixed the metric scale.
        focal: Focal length and whether it was observed.
        standing: Whether the whole clip stands still.
        fallback: Why structure from motion was not used, in words, or None.
        detected: What was noticed, a sentence each.
        details: Figures, as JSON values.
        metres_per_unit: What makes metres of known depth; ``None`` where its unit stays unknown.
        fallback_kind: Why depth is a guess, see ``Geometry``.
        placed: Frames that structure from motion placed; None for all.
    """

    cameras: tuple[Camera, ...]
    fixed_regions: Int[np.ndarray, "h w"]
    region_names: tuple[str, ...]
    ground: Ground | None
    scale: Scale
    focal: Focal
    standing: bool
    fallback: str | None
    detected: tuple[str, ...]
    details: dict[str, Any] = field(default_factory=dict)
    metres_per_unit: float | None = 1.0
    fallback_kind: Fallback | None = None
    placed: int | None = None


def pose_clip(
    clip: Clip, options: GeometryOptions = GeometryOptions(), *, seed: int = 0, tell: Tell = unheard
) -> Posed:
    """Pose every frame of a clip of one camera.

    Known poses are used as they are. A clip that stands still gets one place; it never reaches structure from
    motion, which would register it on whatever drives through the picture. Else structure from motion is
    tried and judged, and frame-to-frame odometry takes over when it is refused. Without a camera height 1.5 m
    is assumed. ``tell`` is called for the first look, and for the steps of ``reconstruct.STEPS``.

    Raises:
        InputError: Without frames; for known poses that contradict the frames.
    """
    if len(clip) == 0:
        raise InputError("The clip holds no frame; at least two are needed for geometry from motion.")
    camera_height_m = options.camera_height_m
    evidence = observe(clip)
    contradiction.check(clip, evidence)
    tell()
    if clip.known.world_from_camera is not None:
        if not clip.known.metric:
            return _from_unscaled(clip, evidence, camera_height_m, seed)
        return _from_known(clip, evidence, camera_height_m, seed)
    if evidence.motion.tracks < MIN_TRACKS and len(clip) > 1:
        reason = "the frames are too dark or too blank to follow anything: the camera is taken to stand still"
        return replace(_standing(clip, evidence, camera_height_m, reason), fallback_kind="blank")
    if evidence.motion.standing:
        reason = "the camera stands still: all frames share one place, and depth cannot be seen from motion"
        return _standing(clip, evidence, camera_height_m, reason)
    outcome = reconstruct(clip, evidence, options.gate, seed, tell)
    if outcome.settled is None:
        return _from_odometry(clip, evidence, outcome, camera_height_m)
    return _from_model(clip, evidence, outcome, camera_height_m, seed)


def _from_model(
    clip: Clip, evidence: Evidence, outcome: MappingOutcome, height_m: float | None, seed: int
) -> Posed:
    """Cameras of an accepted sparse model, scaled to metres."""
    assert outcome.settled is not None
    model, observed = outcome.settled.model, outcome.settled.observed
    camera = clip.rig[0]
    if not clip.known.intrinsics and observed:
        factor = float(model.lens[0]) / evidence.working.fx_px
        camera = replace(camera, fx_px=camera.fx_px * factor, fy_px=camera.fy_px * factor)
    filled = fill(model.world_from_camera, clip.times_s)
    poses, points = rebase(filled, model.points)
    street = PosedClip.of(clip, evidence, camera, poses, points)
    ratios = depth_ratios(clip, camera, poses, points, model.seen)
    if len(ratios):
        metric = scale.from_depth(ratios, street, height_m, seed)
    else:
        metric = scale.from_ground(street, height_m, scale.focal_spread_of(observed), seed)
    poses[:, :3, 3] *= metric.factor
    placed = int(model.registered.sum())
    notes = list(outcome.notes) + list(metric.notes)
    if placed < len(clip):
        notes.append(f"{len(clip) - placed} of {len(clip)} frames were placed between their neighbours")
    details = {**outcome.figures, "residual_radial": float(model.lens[4]), "metres_per_unit": metric.factor}
    posed = as_posed(clip, evidence, poses, camera, metric, observed, notes, details)
    return replace(posed, placed=placed)


def _from_known(clip: Clip, evidence: Evidence, height_m: float | None, seed: int) -> Posed:
    """The user's poses, moved so that the first frame's camera is the world; the road is only looked for."""
    assert clip.known.world_from_camera is not None
    if clip.known.ground is None:
        street = _known_street(clip, evidence)
        still = evidence.motion.standing
        metric = scale.as_given(street, "poses", 0.0, "the given poses", height_m, seed, still)
    else:
        ground = clip.known.ground.seen_from(clip.known.world_from_camera[0])
        metric = Metric(1.0, ground, Scale("poses", 0.0), ())
    return _with_known(clip, evidence, metric, ["the given poses are used", *metric.notes], height_m)


def _from_unscaled(clip: Clip, evidence: Evidence, height_m: float | None, seed: int) -> Posed:
    """The user's poses in an unknown unit: the road, or an assumed speed, makes metres of it.

    Of a camera that stands still the path is noise, and no scale can be read from it: neither poses nor depth
    are used.
    """
    if evidence.motion.standing:
        known = replace(clip.known, world_from_camera=None, depth_m=None, points=None)
        reason = "the camera stands still: the given poses and depth, in an unknown unit, are not used"
        posed = _standing(replace(clip, known=known), evidence, height_m, reason)
        return replace(posed, metres_per_unit=None)
    street = _known_street(clip, evidence)
    focal_spread = scale.focal_spread_of(clip.known.intrinsics)
    metric = scale.from_ground(street, height_m, focal_spread, seed)
    notes = ["the given poses are used; their unit is not known and scaled to metres", *metric.notes]
    posed = _with_known(clip, evidence, metric, notes, height_m)
    return replace(posed, metres_per_unit=metric.factor)


def _known_street(clip: Clip, evidence: Evidence) -> PosedClip:
    """The frames with the known poses, in these poses' unit."""
    assert clip.known.world_from_camera is not None
    points = depth_points(clip)
    if clip.known.points is not None:
        points = np.concatenate([points, clip.known.points])
    poses, points = rebase(clip.known.world_from_camera.astype(np.float64), points)
    return PosedClip.of(clip, evidence, clip.rig[0], poses, points)


def _with_known(
    clip: Clip, evidence: Evidence, metric: Metric, notes: list[str], height_m: float | None
) -> Posed:
    assert clip.known.world_from_camera is not None
    poses, _ = rebase(clip.known.world_from_camera.astype(np.float64), np.zeros((0, 3)))
    poses[:, :3, 3] *= metric.factor
    details = {} if clip.known.metric else {"metres_per_unit": metric.factor}
    standing = evidence.motion.standing and path_length(poses) < 0.5
    guessed = standing and clip.known.depth_m is None
    if guessed and clip.look is not None and metric.ground is None:
        level = _level_road(clip, height_m, STANDING_SPREAD)
        metric, notes = replace(metric, ground=level.ground), [*notes, *level.notes]
    if standing:
        notes = [*notes, "the camera stands still: depth cannot be seen from motion"]
    posed = as_posed(clip, evidence, poses, clip.rig[0], metric, clip.known.intrinsics, notes, details)
    return replace(posed, standing=standing, fallback_kind="standing" if guessed else None)


def _standing(clip: Clip, evidence: Evidence, height_m: float | None, reason: str) -> Posed:
    """One place for all frames above a road that is taken to be level; what turns the camera is measured."""
    poses = turning.turned(evidence.grey, evidence.street, evidence.small)
    points = depth_points(clip)
    camera = clip.rig[0]
    street = PosedClip.of(clip, evidence, camera, poses, points)
    plane = scale.find_ground(street, 0)[0] if len(points) else None
    metric = _level_road(clip, height_m, STANDING_SPREAD)
    if clip.known.depth_m is not None:
        ground = metric.ground if plane is None else Ground(plane.normal, plane.offset)
        of_depth = Scale("depth", 0.0, scale.by_height(plane, 1.0, height_m))
        metric = replace(metric, ground=ground, scale=of_depth)
    notes = [reason] if plane is not None else [reason, *metric.notes]
    posed = as_posed(clip, evidence, poses, camera, metric, clip.known.intrinsics, notes, {})
    return replace(posed, standing=True, fallback=reason, fallback_kind="standing")


def _from_odometry(clip: Clip, evidence: Evidence, outcome: MappingOutcome, height_m: float | None) -> Posed:
    """Frame-to-frame odometry over a road that is taken to be level."""
    metric = _level_road(clip, height_m, FALLBACK_SPREAD)
    assert metric.ground is not None
    if len(clip) == 1:
        path = odometry.Odometry(np.eye(4)[None], np.zeros(0), True)
    else:
        path = odometry.drive(evidence.grey, evidence.street, evidence.small, clip.times_s, metric.ground)
    poses = path.world_from_camera
    if clip.look is not None:
        poses = odometry.levelled(poses, metric.ground.normal_world)
    poses = calm_path(poses, clip.times_s, evidence)
    reason = "structure from motion was refused: " + "; ".join(outcome.reasons)
    notes = [reason, "the path comes from frame-to-frame odometry and is rough", *metric.notes]
    if not path.measured:
        speed = odometry.DEFAULT_SPEED_M_S
        notes.append(f"the road shows no clear motion: a constant speed of {speed:.0f} m/s is assumed")
        words = f"none: a speed of {speed:.0f} m/s is assumed"
        metric = replace(metric, scale=Scale(words, scale.SPEED_SPREAD, basis="usual speed"))
    details = {**outcome.figures, "odometry_measured": path.measured}
    observed = clip.known.intrinsics
    posed = as_posed(clip, evidence, poses, clip.rig[0], metric, observed, notes, details)
    return replace(posed, fallback=reason, fallback_kind=outcome.refusal)


def _level_road(clip: Clip, height_m: float | None, spread: float) -> Metric:
    """A level road under a level camera, or under one that is tilted as the horizon shows that is seen."""
    up, how, notes = np.array([0.0, -1.0, 0.0]), "assumed", tuple[str, ...]()
    if clip.look is not None:
        seen = clip.look.camera
        up, how = seen.up_in(clip.rig[0]), "below the horizon that the street network sees"
        pitch, roll = np.degrees([seen.pitch_rad, seen.roll_rad])
        notes = (
            f"the road is taken to be level {how}: the camera looks {'up' if pitch > 0 else 'down'} by "
            f"{abs(pitch):.1f} degrees and leans to the {'right' if roll > 0 else 'left'} by {abs(roll):.1f}",
        )
        if clip.known.depth_m is None:
            notes += ("depth is what the street network sees in single frames, fitted to that road",)
    ground = Ground(up, scale.USUAL_HEIGHT_M if height_m is None else height_m)
    source = f"level road {how}, {scale.height_words(height_m)}"
    return Metric(1.0, ground, Scale(source, spread, basis=scale.height_basis(height_m)), notes)


def as_posed(
    clip: Clip,
    evidence: Evidence,
    poses: Float[np.ndarray, "f 4 4"],
    camera: Camera,
    metric: Metric,
    observed: bool,
    notes: list[str],
    details: dict[str, Any],
) -> Posed:
    """The cameras of all frames, and what was noticed before and by posing them.

    Poses are in metres, the first the identity; the pinhole has the clip's size; the focal length is observed
    where it was seen or given.
    """
    cameras = tuple(camera.at(pose) for pose in poses)
    scale, known = metric.scale, clip.known
    if known.scale is not None and scale.basis == "given":
        scale = replace(known.scale, others=scale.others, against=scale.against)
    figures = {
        "flow_px_at_320": float(np.median(evidence.motion.flow_px)) if len(clip) > 1 else 0.0,
        "moving_steps": int(evidence.motion.moving.sum()),
        "brightness": evidence.motion.brightness,
        "path_m": path_length(poses),
    }
    return Posed(
        cameras=cameras,
        fixed_regions=evidence.fixed.regions,
        region_names=evidence.fixed.names,
        ground=metric.ground,
        scale=scale,
        focal=Focal(camera.fx_px, observed and not known.focal_guessed),
        standing=False,
        fallback=None,
        detected=evidence.detected + tuple(notes),
        details=figures | details,
    )
