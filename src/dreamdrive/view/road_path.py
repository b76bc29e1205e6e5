"""A path that is drawn on the road: points, the spline through them, and the drive along it."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.interpolate import PchipInterpolator

from dreamdrive.drive import resampled, smooth
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.splat import render_scene

HEIGHT_M = 1.5
"""Of a camera above the road, where the scene does not know its own."""
APART_M = 0.3
"""Points that are nearer to one another count as one."""
HZ = 20.0
"""Poses a second; that of ``drive.smooth`` where the recording gives more."""
_STEP_M, _LEAST_M, _FARTHEST_M = 0.25, 1e-4, 100.0
_DIGITS = 4
_PICKED_ALPHA = 0.5
# Splats beside a very narrow view are projected as at its rim, and leave holes in its middle.
_PROBE_PX, _PROBE_FOCAL_PX = 161, 500.0


def height_m(scene: Scene) -> float:
    """Height of the recorded camera above the road."""
    return scene.provenance.camera_height_m or HEIGHT_M


def picked(
    scene: Scene, origin: Float[np.ndarray, "3"], direction: Float[np.ndarray, "3"], t_s: float
) -> Float[np.ndarray, "3"] | None:
    """The place at which a ray meets what stands in a scene, or where there is a gap the plane of its road.

    None in the sky.
    """
    ahead = direction / np.linalg.norm(direction)
    aside = np.cross(ahead, scene.up)
    if np.linalg.norm(aside) < 1e-6:
        aside = np.cross(ahead, np.array([1.0, 0.0, 0.0]))
    aside /= np.linalg.norm(aside)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([aside, np.cross(ahead, aside), ahead], axis=1)
    pose[:3, 3] = origin
    middle_px = _PROBE_PX / 2
    probe = Camera(_PROBE_FOCAL_PX, _PROBE_FOCAL_PX, middle_px, middle_px, _PROBE_PX, _PROBE_PX, pose)
    seen = render_scene(scene, probe, t_s, part="static")
    middle = _PROBE_PX // 2
    if float(seen.alpha[middle, middle]) < _PICKED_ALPHA:
        return _on_the_plane(scene, origin, ahead)
    return origin + float(seen.depth_m[middle, middle]) * ahead


def _on_the_plane(
    scene: Scene, origin: Float[np.ndarray, "3"], ahead: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3"] | None:
    """Where a ray meets the road below the first camera; None beyond ``_FARTHEST_M``."""
    up, first = scene.up, scene.trajectory.positions_m[0]
    above_m, falls = float((origin - first) @ up) + height_m(scene), -float(ahead @ up)
    if above_m <= 0 or falls * _FARTHEST_M < above_m:
        return None
    return origin + above_m / falls * ahead


def spline(points_m: Sequence[Float[np.ndarray, "3"]]) -> Float[np.ndarray, "n 3"]:
    """Points along the curve through some on the road, a quarter of a metre apart.

    Raises:
        InputError: There are fewer than two of them.
    """
    kept: list[np.ndarray] = []
    for point in points_m:
        if not kept or np.linalg.norm(point - kept[-1]) > APART_M:
            kept.append(np.asarray(point, np.float64))
    if len(kept) < 2:
        raise InputError("a path needs two points on the road, a step apart; click where it shall go")
    points = np.stack(kept).round(_DIGITS)  # slopes of next to nothing overflow
    at_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    along = np.linspace(0, at_m[-1], int(np.ceil(at_m[-1] / _STEP_M)) + 1)
    road = np.stack([PchipInterpolator(at_m, axis)(along) for axis in points.T], axis=1)
    goes_on = np.linalg.norm(np.diff(road, axis=0), axis=1) > _LEAST_M  # not where a path turns back
    return road[np.concatenate([[True], goes_on])]


def drive_along(scene: Scene, points_m: Sequence[Float[np.ndarray, "3"]], seconds: float) -> Trajectory:
    """The drive of the camera along a path at an even speed, from the first recorded time on.

    The camera is as high above it as the recorded one, and looks where the path goes, tilted as at first.

    Raises:
        InputError: See ``spline``; or the time is none.
    """
    if not 0.1 <= seconds <= 3600:
        raise InputError(f"a drive of {seconds:g} s: expected 0.1 to 3600")
    up, road = scene.up, spline(points_m)
    places = road + height_m(scene) * up
    at_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    first_s = float(scene.times_s[scene.front[0]])
    times_s = first_s + seconds * at_m / at_m[-1]
    ahead = np.gradient(places, axis=0)
    poses = np.tile(np.eye(4), (len(places), 1, 1))
    poses[:, :3, :3] = _facing(_level(ahead, scene), up) @ _tilt(scene)
    poses[:, :3, 3] = places
    rate = max(
        HZ, 1 / float(np.median(np.diff(smooth(scene.trajectory).times_s))) if len(scene.front) > 1 else 0
    )
    return resampled(Trajectory(poses, times_s), rate)


def _level(ahead: Float[np.ndarray, "n 3"], scene: Scene) -> Float[np.ndarray, "n 3"]:
    """Directions along the ground; where a path turns back or goes straight up, that of the recording."""
    up, recorded = scene.up, scene.trajectory.world_from_camera[0][:3, 2]
    level = ahead - (ahead @ up)[:, None] * up
    along = np.linalg.norm(level, axis=1, keepdims=True)
    return np.where(along > 1e-3, level, recorded - (recorded @ up) * up)


def _facing(ahead: Float[np.ndarray, "n 3"], up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "n 3 3"]:
    """Attitudes (x right, y down, z ahead) of cameras that look level along directions."""
    level = ahead - (ahead @ up)[:, None] * up
    level /= np.maximum(np.linalg.norm(level, axis=1, keepdims=True), 1e-9)
    right = np.cross(level, up)
    return np.stack([right, np.broadcast_to(-up, right.shape), level], axis=2)


def _tilt(scene: Scene) -> Float[np.ndarray, "3 3"]:
    """How the first recorded camera is turned against the level one that looks the same way."""
    first = scene.trajectory.world_from_camera[0]
    return _facing(first[None, :3, 2], scene.up)[0].T @ first[:3, :3]
