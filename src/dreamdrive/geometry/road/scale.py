"""Metric scale and the road plane of a posed clip."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.geometry.evidence import Evidence
from dreamdrive.geometry.road.ground_points import Plane, fit_points
from dreamdrive.geometry.road.ground_sweep import RoadSweep, sweep
from dreamdrive.geometry.road.known_depth import factor_of
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Basis, Ground, Scale

USUAL_HEIGHT_M = 1.5
KNOWN_HEIGHTS_M = (0.6, 5.0)
CARRIED_HEIGHTS_M = (1.0, 3.5)
"""From a low car to a tall lorry: other heights of a camera say that a unit is no metre."""
AGREES = 0.15  # relative; a height that differs more is worth a note
MIN_INLIERS, MIN_SHARE = 100, 0.25
SPEEDS_M_S = (0.5, 45.0)
ASSUMED_SPEED_M_S = 8.0
GIVEN_SPREAD, USUAL_SPREAD, FOCAL_SPREAD, SPEED_SPREAD = 0.03, 0.15, 0.35, 0.6


@dataclass(frozen=True)
class PosedClip:
    """A clip with poses, in which the road is looked for."""

    grey: UInt8[np.ndarray, "f h w"]  # at 320 px width
    usable: Bool[np.ndarray, "f h w"]  # pixels that belong to the street
    camera: Camera  # at that size
    world_from_camera: Float[np.ndarray, "f 4 4"]  # the first the identity
    points: Float[np.ndarray, "p 3"]  # sparse ones, in the same units
    times_s: Float[np.ndarray, " f"]
    asked_m_s: float | None = None  # speed of the path that generated frames were asked to follow

    @staticmethod
    def of(
        clip: Clip,
        evidence: Evidence,
        camera: Camera,
        world_from_camera: Float[np.ndarray, "f 4 4"],
        points: Float[np.ndarray, "p 3"],
    ) -> "PosedClip":
        """A clip with the pinhole of its frames, poses and points."""
        small = camera.resized(evidence.small.width_px, evidence.small.height_px)
        frames = evidence.grey, evidence.street, small
        return PosedClip(*frames, world_from_camera, points, clip.times_s, asked_m_s(clip))


@dataclass(frozen=True)
class Metric:
    """How to get to metres."""

    factor: float  # metres per unit of the poses
    ground: Ground | None  # in metres
    scale: Scale
    notes: tuple[str, ...]  # what went wrong, a sentence each


def find_ground(
    street: PosedClip, seed: int, heights: tuple[float, float] | None = None
) -> tuple[Plane | None, str]:
    """The road plane and the name of the estimator that gave it.

    Sparse points decide when at least 100 of them, a quarter of those near the path, lie in the plane; smooth
    asphalt has too few, and there the plane that best warps the road between frames decides.
    """
    plane = fit_points(street.points, street.world_from_camera, seed)
    if plane is not None and plane.support >= MIN_INLIERS and plane.share >= MIN_SHARE:
        return plane, "points"
    road = RoadSweep(street.grey, street.usable, street.camera, street.world_from_camera)
    return sweep(road, heights), "road texture"


def focal_spread_of(observed: bool) -> float:
    """How far a focal length may be off, as a fraction: not at all where it was observed."""
    return 0.0 if observed else FOCAL_SPREAD


def from_ground(street: PosedClip, height_m: float | None, focal_spread: float, seed: int) -> Metric:
    """Scale from the height of the camera above the road; from a speed, asked for or assumed, without a road.

    Without a height 1.5 m, a car's, is assumed. The scale is as uncertain as the focal length, which may be
    off by the fraction ``focal_spread``: 0 where it was observed, ``FOCAL_SPREAD`` where it is only a prior.
    """
    plane, how = find_ground(street, seed)
    if plane is None:
        return _from_speed(street, "no road plane was found")
    found = _by_plane(plane, how, height_m, focal_spread)
    speed = median_speed(street) * found.factor
    if not SPEEDS_M_S[0] <= speed <= SPEEDS_M_S[1]:
        problem = f"the road plane that was found implies {speed:.1f} m/s, which no car drives"
        return _from_speed(street, problem)
    return found


def _by_plane(plane: Plane, how: str, height_m: float | None, focal_spread: float) -> Metric:
    factor = (USUAL_HEIGHT_M if height_m is None else height_m) / plane.height
    terms = plane.spread, USUAL_SPREAD if height_m is None else GIVEN_SPREAD, focal_spread
    source = f"ground plane ({how}), {height_words(height_m)}"
    found = Scale(source, float(np.linalg.norm(terms)), basis=height_basis(height_m))
    return Metric(factor, Ground(plane.normal, plane.offset * factor), found, ())


def from_road_points(
    street: PosedClip, height_m: float | None, focal_spread: float, seed: int
) -> Metric | None:
    """Scale from the height of the camera above the road that measured depth shows, however slow the path.

    Unlike a plane that is found by warping, it does not rest on the motion of the camera: the points of the
    street are those of dense depth. None where they show no road, or one by which no car drives so fast. The
    rest is as in ``from_ground``.
    """
    plane = fit_points(street.points, street.world_from_camera, seed)
    if plane is None or plane.support < MIN_INLIERS or plane.share < MIN_SHARE:
        return None
    found = _by_plane(plane, "points", height_m, focal_spread)
    return None if median_speed(street) * found.factor > SPEEDS_M_S[1] else found


def from_depth(
    ratios: Float[np.ndarray, " n"], street: PosedClip, height_m: float | None, seed: int
) -> Metric:
    """Scale from known depth over the depth of sparse points, ``ratios`` (N,)."""
    factor, spread = factor_of(ratios)
    plane, _ = find_ground(street, seed)
    ground = None if plane is None else Ground(plane.normal, plane.offset * factor)
    return Metric(factor, ground, Scale("depth", spread, by_height(plane, factor, height_m)), ())


def by_height(plane: Plane | None, factor: float, height_m: float | None) -> dict[str, float]:
    """What the camera's height above the road, given or 1.5 m, says of a scale, for ``Scale.others``.

    The plane is in units of the poses, of which the scale makes ``factor`` metres.
    """
    if plane is None:
        return {}
    wanted = USUAL_HEIGHT_M if height_m is None else height_m
    return {height_words(height_m): wanted / (plane.height * factor)}


def height_words(height_m: float | None) -> str:
    """The camera's height above the road and where it comes from."""
    wanted, word = (USUAL_HEIGHT_M, "assumed") if height_m is None else (height_m, "given")
    return f"camera height {wanted:.2f} m ({word})"


def height_basis(height_m: float | None) -> Basis:
    """What a scale rests on that comes from the camera's height."""
    return "usual height" if height_m is None else "height"


def as_given(
    street: PosedClip,
    source: str,
    spread: float,
    words: str,
    height_m: float | None,
    seed: int,
    still: bool = False,
) -> Metric:
    """The unit of the poses is the metre already, says ``source``; the road is only looked for.

    The metre may be off by the fraction ``spread``. ``words`` name the source in a note, where the road
    disagrees. On a path of a camera that stands ``still`` no road shows another unit.
    """
    plane, _ = find_ground(street, seed, KNOWN_HEIGHTS_M)
    if plane is None and not still:
        plane, _ = find_ground(street, seed)  # in whatever unit, to say that it is no metre
    ground = None if plane is None else Ground(plane.normal, plane.offset)
    found_m = None if plane is None else plane.height
    against = contradicted(found_m, height_m, median_speed(street))
    notes = (f"by {words} {against}",) if against else ()
    return Metric(1.0, ground, Scale(source, spread, by_height(plane, 1.0, height_m), against=against), notes)


def contradicted(found_m: float | None, height_m: float | None, speed_m_s: float = 0.0) -> str:
    """What speaks against a path that was given in metres, in words; nothing where all is as it can be.

    Args:
        found_m: Height of the camera above the road by that path; None where no road was found.
        height_m: The same as it was told; None: not told.
        speed_m_s: How fast the car drives by it.
    """
    if found_m is not None and height_m is not None and abs(found_m / height_m - 1) > AGREES:
        return f"the camera is {found_m:.2f} m above the road, not {height_m:.2f} m"
    low, high = CARRIED_HEIGHTS_M
    if found_m is not None and height_m is None and not low <= found_m <= high:
        return f"the camera is {found_m:.2f} m above the road, where cars carry it {low:g} to {high:g} m high"
    return f"the car drives {speed_m_s:.0f} m/s" if speed_m_s > SPEEDS_M_S[1] else ""


def _from_speed(street: PosedClip, problem: str) -> Metric:
    speed, word, rest = street.asked_m_s, "taken as asked for", "the speed that was asked for"
    basis: Basis = "asked speed"
    if speed is None:
        speed, word, rest, basis = ASSUMED_SPEED_M_S, "assumed", "an assumed speed", "usual speed"
    found = Scale(f"none: {problem}; a speed of {speed:.3g} m/s is {word}", SPEED_SPREAD, basis=basis)
    factor = speed / max(median_speed(street), 1e-9)
    return Metric(factor, None, found, (f"{problem}: distances rest on {rest}",))


def asked_m_s(clip: Clip) -> float | None:
    """Median speed of the path that a clip was asked to follow; None without one or where it stands still."""
    if clip.requested is None or len(clip) < 2:
        return None
    speed = _median_speed(clip.requested.at(clip.times_s), clip.times_s)
    return speed if speed >= SPEEDS_M_S[0] else None


def median_speed(street: PosedClip) -> float:
    """Median speed of the steps that move, in units of the poses a second."""
    return _median_speed(street.world_from_camera, street.times_s)


def _median_speed(poses: Float[np.ndarray, "f 4 4"], times_s: Float[np.ndarray, " f"]) -> float:
    """Median speed of the steps that move."""
    step = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    speed = step / np.maximum(np.diff(times_s), 1e-6)
    moving = speed > 0.15 * speed.max()
    return float(np.median(speed[moving])) if moving.any() else 0.0
