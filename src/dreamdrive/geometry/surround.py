"""Geometry of several cameras, on one car or on several drives: each by itself, in the world of the first."""

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.geometry.road import in_metres
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.trajectory import Trajectory


def reconstruct_cameras(clip: Clip, reconstruct: Callable[[Clip], Geometry]) -> Geometry:
    """Reconstruct the first camera, then the others from where it tells that they were.

    The path of the first camera and the mountings of the rig give the poses of all others, unless poses are
    known or all begin at the same frame; metres and the road are those of the first camera. ``reconstruct``
    takes frames of one camera.

    Raises:
        InputError: Neither poses nor mountings are known; or see ``reconstruct``.
    """
    lead = int(clip.camera[0])
    if clip.known.world_from_camera is None and clip.known.shared_first:
        return _from_first_frame(clip, lead, reconstruct)
    if clip.known.world_from_camera is None and _unmounted(clip):
        raise InputError(
            f"the clip has {len(clip.rig)} cameras, and neither their poses nor how they are mounted is "
            "known; give the poses, or the frames of one camera"
        )
    first = reconstruct(clip.only(lead))
    poses = _poses(clip, lead, first)
    parts = {lead: first}
    for camera in np.unique(clip.camera).tolist():
        if camera != lead:
            parts[camera] = _other(clip, camera, poses, first, reconstruct)
    return _merged(clip, lead, parts, poses)


def _from_first_frame(clip: Clip, lead: int, reconstruct: Callable[[Clip], Geometry]) -> Geometry:
    """Drives from one first frame, each by itself: the depth of that frame tells their common metre."""
    parts = {camera: reconstruct(clip.only(camera)) for camera in np.unique(clip.camera).tolist()}
    first, poses = parts[lead], np.zeros((len(clip), 4, 4))
    for camera, part in parts.items():
        both = (first.depth_m[0] > 0) & (part.depth_m[0] > 0)
        scale = float(np.median(first.depth_m[0][both] / part.depth_m[0][both])) if both.any() else 1.0
        parts[camera] = replace(part, depth_m=(scale * part.depth_m).astype(np.float32))
        own = np.stack([each.world_from_camera for each in part.cameras])
        own[:, :3, 3] *= scale
        poses[clip.of_camera(camera)] = own
    return _merged(clip, lead, parts, poses)


def _unmounted(clip: Clip) -> bool:
    """Whether two cameras of the rig are at the same place, looking the same way: no mounting was given."""
    mountings = [camera.world_from_camera for camera in clip.rig]
    return any(np.allclose(one, other) for one, other in combinations(mountings, 2))


def _poses(clip: Clip, lead: int, first: Geometry) -> Float[np.ndarray, "f 4 4"]:
    """Poses of all frames in the world of the first camera, in metres."""
    if clip.known.world_from_camera is not None:
        known = clip.known.world_from_camera.astype(np.float64)
        poses = np.linalg.inv(known[0]) @ known
        poses[:, :3, 3] *= 1.0 if first.metres_per_unit is None else first.metres_per_unit
        return poses
    led = np.stack([camera.world_from_camera for camera in first.cameras])
    from_lead = np.linalg.inv(clip.rig[lead].world_from_camera)
    lead_poses = Trajectory(led, clip.times_s[clip.of_camera(lead)]).at(clip.times_s)
    return np.stack(
        [
            pose @ from_lead @ clip.rig[int(camera)].world_from_camera
            for pose, camera in zip(lead_poses, clip.camera, strict=True)
        ]
    )


def _other(
    clip: Clip,
    camera: int,
    poses: Float[np.ndarray, "f 4 4"],
    first: Geometry,
    reconstruct: Callable[[Clip], Geometry],
) -> Geometry:
    """One of the other cameras, from known poses over the known road."""
    part = in_metres(clip.only(camera), 1.0 if clip.known.metric else first.metres_per_unit)
    known: Known = replace(
        part.known,
        world_from_camera=poses[clip.of_camera(camera)],
        metric=True,
        points=None,
        ground=first.ground,
    )
    try:
        return reconstruct(replace(part, known=known))
    except InputError as error:
        raise InputError(f"camera {camera} of the rig: {error}") from error


def _merged(clip: Clip, lead: int, parts: dict[int, Geometry], poses: Float[np.ndarray, "f 4 4"]) -> Geometry:
    """All cameras in one, in the order of the clip."""
    first = parts[lead]
    names = tuple(dict.fromkeys(name for part in parts.values() for name in part.region_names))
    fixed = np.zeros((len(clip.rig), *first.fixed_regions.shape[1:]), first.fixed_regions.dtype)
    for camera, part in parts.items():
        renamed = np.array([0, *(names.index(name) + 1 for name in part.region_names)])
        fixed[camera] = renamed[part.fixed_regions[0]]
    cameras = [
        parts[int(camera)].cameras[step].at(pose)
        for camera, step, pose in zip(clip.camera, clip.step, poses, strict=True)
    ]
    said = [
        note if k == lead else f"camera {k}: {note}" for k, part in parts.items() for note in part.detected
    ]
    return replace(
        first,
        cameras=tuple(cameras),
        **{name: _woven(clip, maps) for name, maps in _maps_of(parts).items()},
        fixed_regions=fixed,
        region_names=names,
        detected=tuple(dict.fromkeys(said)),
        details=first.details | {"cameras": {str(k): p.details for k, p in parts.items() if k != lead}},
    )


def _maps_of(parts: dict[int, Geometry]) -> dict[str, dict[int, Any]]:
    """Maps of each camera by their names; road users of two cameras have no number in common."""
    found: dict[str, dict[int, Any]] = {}
    kinds = (
        "depth_m",
        "confidence",
        "sky",
        "moving",
        "spread",
        "road_users",
        "stereo_ratio",
        "stereo_confidence",
    )
    for name in kinds:
        maps = {camera: getattr(part, name) for camera, part in parts.items()}
        if all(each is not None for each in maps.values()):
            found[name] = maps
    first = 0
    for camera, numbers in found.get("road_users", {}).items():
        found["road_users"][camera] = np.where(numbers > 0, numbers + np.uint16(first), 0).astype(np.uint16)
        first += int(numbers.max(initial=0))
    return found


def _woven(clip: Clip, maps: dict[int, Any]) -> Any:
    """Maps of all frames (F, H, W) from those of each camera."""
    some = next(iter(maps.values()))
    whole = np.zeros((len(clip), *some.shape[1:]), some.dtype)
    for camera, values in maps.items():
        whole[clip.of_camera(camera)] = values
    return whole
