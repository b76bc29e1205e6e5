"""A clip or photo of a camera that hung upside down, turned upright."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from dreamdrive.data.cameras.distortion import Distortion
from dreamdrive.data.cameras.lens import SourceLens
from dreamdrive.data.photo import Photo
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known, Recorded
from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.trajectory import Trajectory

_HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
"""Of a camera about its axis: upside down from upright, and back."""
_TURNED_COEFFICIENTS = (2, 3, 8, 9, 10, 11, 12, 13)
"""Of OpenCV's model: those that move points by the same for both ends of a line through the middle."""
NOTE = "The camera hung upside down: the pictures are turned upright, and what is known of it with them."


def turned_photo(photo: Photo) -> Photo:
    """The photo after half a turn."""
    rgb = np.ascontiguousarray(photo.rgb[::-1, ::-1])
    return replace(photo, rgb=rgb, camera=_pinhole(photo.camera), notes=(*photo.notes, NOTE))


def turned_clip(clip: Clip) -> Clip:
    """The clip of one camera after half a turn, with poses, depth and features."""
    taken, asked = clip.recorded, clip.requested
    return replace(
        clip,
        frames=_maps(clip.frames),
        valid=_maps(clip.valid),
        rig=tuple(_pinhole(camera) for camera in clip.rig),
        features={name: _maps(values) for name, values in clip.features.items()},
        known=_known(clip.known),
        requested=None if asked is None else Trajectory(_path(asked.world_from_camera), asked.times_s),
        recorded=None if taken is None else _recorded(taken, clip.size),
        provenance={**clip.provenance, "notes": [*clip.provenance.get("notes", []), NOTE]},
    )


def _maps(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values[:, ::-1, ::-1])


def _pinhole(camera: Camera) -> Camera:
    return replace(camera, cx_px=camera.width_px - camera.cx_px, cy_px=camera.height_px - camera.cy_px)


def _path(poses: Float[np.ndarray, "f 4 4"]) -> Float[np.ndarray, "f 4 4"]:
    """Poses in a world that is the first camera, which is turned as all are."""
    return _HALF_TURN @ poses @ _HALF_TURN


def _known(known: Known) -> Known:
    poses, points, ground = known.world_from_camera, known.points, known.ground
    turn = _HALF_TURN[:3, :3]
    return replace(
        known,
        world_from_camera=None if poses is None else _path(poses),
        depth_m=None if known.depth_m is None else _maps(known.depth_m),
        sky=None if known.sky is None else _maps(known.sky),
        points=None if points is None else points @ turn,
        ground=None if ground is None else Ground(turn @ ground.normal_world, ground.offset_m),
    )


def _recorded(taken: Recorded, size: tuple[int, int]) -> Recorded:
    left, top = (taken.scaled[k] - size[k] - taken.offset[k] for k in (0, 1))
    lens = None if taken.lens is None else turned_lens(SourceLens.from_json(taken.lens)).to_json()
    return replace(taken, offset=(left, top), lens=lens, turned=True)


def turned_lens(lens: SourceLens) -> SourceLens:
    """The lens as it bends the turned pictures."""
    model, coefficients = lens.distortion.model, lens.distortion.coefficients
    if model == "opencv":
        coefficients = tuple(-c if k in _TURNED_COEFFICIENTS else c for k, c in enumerate(coefficients))
    return SourceLens(Distortion(model, coefficients), _pinhole(lens.camera))
