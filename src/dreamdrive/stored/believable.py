"""Checks that the parts of a stored scene belong together, and none is larger or farther than scenes have."""

import numpy as np
import torch
from jaxtyping import Float16

from dreamdrive.scene.camera import FARTHEST_M, Camera, check_rigid
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.vision.residual import BLOCK_PX

MAX_PIXELS = 64_000_000
"""Most pixels of a view, and of a sky."""
_LATEST_S = 1e10
_BRIGHTEST = 1e6
_WIDEST_RAD = 10.0


def check_scene(scene: Scene) -> None:
    """Raise ``ValueError`` with what is wrong."""
    _check_views(scene)
    _check_gaussians(scene)
    _check_colours(scene)
    _check_provenance(scene.provenance, len(scene.cameras))
    _check_actors(scene)


def _check_views(scene: Scene) -> None:
    if not np.abs(scene.times_s).max() <= _LATEST_S:
        raise ValueError(f"views are at times beyond {_LATEST_S:g} s")
    for camera in (0,) if scene.camera is None else np.unique(scene.camera).tolist():
        own = slice(None) if scene.camera is None else scene.camera == camera
        if (np.diff(scene.times_s[own]) <= 0).any():
            raise ValueError("times of the views do not increase")
    if max(camera.width_px * camera.height_px for camera in scene.cameras) > MAX_PIXELS:
        raise ValueError(f"a view has more than {MAX_PIXELS:.0e} pixels")
    if scene.residual is not None:
        _check_residual(scene.residual, scene.cameras)


def _check_residual(residual: Float16[np.ndarray, "f bh bw"], cameras: tuple[Camera, ...]) -> None:
    shapes = {(len(cameras), c.height_px // BLOCK_PX, c.width_px // BLOCK_PX) for c in cameras}
    if shapes != {residual.shape} or not 0 <= residual.min() <= residual.max() <= 1:
        raise ValueError("residuals are none of these views")


def _check_gaussians(scene: Scene) -> None:
    count = len(scene.cameras)
    for part in (scene.static, scene.dynamic):
        if problem := part.problem():
            raise ValueError(problem)
        if len(part) and not 0 <= int(part.source_frame.min()) <= int(part.source_frame.max()) < count:
            raise ValueError(f"Gaussians come from frames beyond the {count} of the scene")
    if scene.moves_per_frame and scene.static.lifespan is None:
        raise ValueError("Gaussians of single frames have no life spans")
    if scene.deformation is not None and len(scene.dynamic):
        scene.deformation.check(scene.dynamic)


def _check_actors(scene: Scene) -> None:
    if len({actor.id for actor in scene.actors}) < len(scene.actors):
        raise ValueError("two actors have one id")
    for actor in scene.actors:
        if not np.abs(actor.track.times_s).max() <= _LATEST_S:
            raise ValueError(f"{actor.name} is tracked at times beyond {_LATEST_S:g} s")


def _check_colours(scene: Scene) -> None:
    """The sky and the exposure, which has to tell of each camera of the rig."""
    if scene.sky is not None:
        texture = scene.sky.texture
        if not 0 < texture.numel() <= 3 * MAX_PIXELS:
            raise ValueError(f"the sky has {tuple(texture.shape)} texels")
        ends = (*scene.sky.azimuth_rad, *scene.sky.elevation_rad)
        if not float(texture.abs().max()) <= _BRIGHTEST or not max(map(abs, ends)) <= _WIDEST_RAD:
            raise ValueError("the sky is brighter or wider than skies are")
    if scene.exposure is not None:
        if not float(torch.abs(scene.exposure.transforms).max()) <= _BRIGHTEST:
            raise ValueError(f"the exposure changes colours by more than {_BRIGHTEST:g}")
        known = scene.exposure.camera
        wanted = np.zeros(1) if scene.camera is None else scene.camera
        if known is not None and not np.isin(wanted, known).all():
            raise ValueError("the exposure does not tell of all cameras")


def _check_provenance(about: Provenance, count: int) -> None:
    if about.source_index is not None and len(about.source_index) != count:
        raise ValueError(f"source_index names {len(about.source_index)} frames of {count}")
    if about.up is not None and not abs(float(np.linalg.norm(about.up)) - 1) <= 1e-3:
        raise ValueError(f"up is {about.up}, not a unit vector")
    if about.camera_height_m is not None and not abs(about.camera_height_m) <= FARTHEST_M:
        raise ValueError(f"camera_height_m is {about.camera_height_m:g}")
    if about.log is not None:
        check_rigid(np.array(about.log.log_from_world), "log_from_world")
