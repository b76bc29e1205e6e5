"""Known poses made finer: the frames show the path, the poses how long it is."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.geometry.cameras.paths import path_length, without_poses
from dreamdrive.geometry.road import scale
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry, Ground, Scale
from dreamdrive.scene.similarity import fit_similarity

_MOST_APART = 0.05  # of the path's length, root mean square
_STANDING_M = 0.5


def refined(clip: Clip, reconstruct: Callable[[Clip], Geometry]) -> Geometry:
    """Reconstruct without the known poses, then give the path their length.

    Poses of a positioning system are true over a street and wrong between two frames: 0.1 degrees move what
    is far away by a pixel. On PandaSet its own poses give 27.8 dB on held-out frames, refined 28.8 dB.

    Raises:
        InputError: No poses are known, or not in metres; or the path that the frames show is another one.
    """
    known = clip.known.world_from_camera
    if known is None or not clip.known.metric:
        what = "there are none" if known is None else "their unit is not known"
        raise InputError(f"poses can only be refined where they are given in metres; {what}")
    if len(clip.rig) > 1:
        raise InputError(f"poses of one camera can be refined; the clip has {len(clip.rig)}")
    found = reconstruct(without_poses(clip)) if path_length(known) > _STANDING_M else None
    if found is None or found.fallback is not None:
        why = "the camera stands still" if found is None else found.fallback
        given = reconstruct(clip)
        return replace(given, detected=(*given.detected, f"the given poses are not refined: {why}"))
    return _with_length_of(found, known.astype(np.float64))


def _with_length_of(geometry: Geometry, known: Float[np.ndarray, "f 4 4"]) -> Geometry:
    """The geometry in metres of the known path, if it is the same path."""
    wanted = [camera.at(pose) for camera, pose in zip(geometry.cameras, known, strict=True)]
    onto = fit_similarity(geometry.cameras, wanted)
    poses = np.stack([camera.world_from_camera for camera in geometry.cameras])
    apart_m = np.linalg.norm(onto(poses[:, :3, 3]) - known[:, :3, 3], axis=1)
    share = float(np.sqrt(np.square(apart_m).mean())) / path_length(known)
    if share > _MOST_APART:
        raise InputError(
            f"the given poses and the path that the frames show are {share:.0%} of its length apart, too far "
            "for refining: are they of these frames, in metres, world-from-camera?"
        )
    rest = np.swapaxes(known[:, :3, :3], 1, 2) @ onto.rotation @ poses[:, :3, :3]
    turned_deg = np.degrees(np.arccos(np.clip((np.trace(rest, axis1=1, axis2=2) - 1) / 2, -1, 1)))
    note = (
        f"the given poses are refined by the frames: moved by {apart_m.max():.2f} m and turned by "
        f"{turned_deg.max():.2f} degrees at most"
    )
    scaled = _scaled(geometry, onto.scale)
    return replace(scaled, detected=(*scaled.detected, note))


def _scaled(geometry: Geometry, factor: float) -> Geometry:
    """All lengths times a factor, which the known path gives."""
    longer = np.vstack([np.tile([1, 1, 1, factor], (3, 1)), np.ones(4)])
    cameras = tuple(camera.at(longer * camera.world_from_camera) for camera in geometry.cameras)
    ground, before = geometry.ground, geometry.scale
    others = {name: ratio / factor for name, ratio in before.others.items()} | {before.source: 1 / factor}
    against = ""
    if ground is not None:
        told_m = ground.offset_m if before.basis == "height" else None
        against = scale.contradicted(ground.offset_m * factor, told_m)
    return replace(
        geometry,
        cameras=cameras,
        depth_m=geometry.depth_m * np.float32(factor),
        ground=None if ground is None else Ground(ground.normal_world, ground.offset_m * factor),
        scale=Scale("length of the given path", 0.0, others, against=against),
    )
