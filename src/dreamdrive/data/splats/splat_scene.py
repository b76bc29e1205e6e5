"""A file of Gaussians as a scene that never moves, with cameras that are given or stand around it."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from dreamdrive.data.cameras.poses import read_trajectory
from dreamdrive.data.formats.colmap import colmap_camera, find_colmap, read_colmap
from dreamdrive.data.formats.rigid import clean_poses
from dreamdrive.data.splats.read_splats import Up, read_splats
from dreamdrive.data.splats.splats import turned
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.scene.trajectory import Trajectory

_PINHOLE = Camera(554.0, 554.0, 320.0, 180.0, 640, 360)
"""Sees 60 degrees across."""
_AROUND, _RATE_HZ = 24, 10.0
_AWAY, _ABOVE = 2.2, 0.5
"""Of the distance within which nine in ten Gaussians lie from their middle."""


@dataclass(frozen=True)
class SplatScene:
    """A scene of a file.

    Attributes:
        scene: Static Gaussians; its world is that of its first camera.
        dropped: Gaussians of the file that cannot be drawn, and are not there.
        cameras: What its cameras are, in words.
    """

    scene: Scene
    dropped: int
    cameras: str


def read_splat_scene(path: Path, *, cameras: Path | None = None, up: Up | None = None) -> SplatScene:
    """Read a PLY, SPZ or GLB file as a scene.

    Args:
        path: The file.
        cameras: Views of the same world as the file: a trajectory with times, TUM or JSON, or the folder of a
            COLMAP model. Without it views stand around the Gaussians and look at their middle.
        up: The axis of the file that points up; see ``read_splats``.

    Raises:
        InputError: A file cannot be read, or the cameras do not fit.
    """
    gaussians, dropped, rotation = read_splats(path, up)
    if cameras is None:
        drive, pinholes = _around(gaussians), (_PINHOLE,) * _AROUND
        said = f"Its cameras are {_AROUND} views from around it: the file has none."
    else:
        drive, pinholes, said = _given(cameras)
        turn = np.eye(4)
        turn[:3, :3] = rotation
        drive = replace(drive, world_from_camera=turn @ drive.world_from_camera)
    first = drive.world_from_camera[0]
    from_first = np.linalg.inv(first)
    from_first[:3, :3] = first[:3, :3].T
    moved = turned(gaussians, from_first[:3, :3])
    moved = replace(moved, means=moved.means + moved.means.new_tensor(from_first[:3, 3]))
    if problem := moved.problem():
        raise InputError(f"{cameras} does not belong to {path}: {problem}")
    poses = from_first @ drive.world_from_camera
    poses[0] = np.eye(4)
    up_there = tuple(float(each) for each in from_first[:3, :3] @ (0.0, -1.0, 0.0))
    scene = Scene(
        static=moved,
        dynamic=moved.select(moved.source_frame[:0]),
        deformation=None,
        actors=(),
        sky=None,
        exposure=None,
        cameras=tuple(pinhole.at(pose) for pinhole, pose in zip(pinholes, poses, strict=True)),
        times_s=drive.times_s,
        held_out=np.zeros(len(poses), bool),
        provenance=Provenance(input=path.name, up=(up_there[0], up_there[1], up_there[2])),
    )
    return SplatScene(scene, dropped, said)


def _around(gaussians: Gaussians) -> Trajectory:
    """A circle around the middle of Gaussians, that looks at it from above."""
    means = gaussians.means.double().numpy()
    middle = np.median(means, axis=0)
    reach_m = max(float(np.quantile(np.linalg.norm(means - middle, axis=1), 0.9)), 0.5)
    poses = np.tile(np.eye(4), (_AROUND, 1, 1))
    for pose, angle in zip(poses, np.arange(_AROUND) / _AROUND * 2 * np.pi, strict=True):
        away = np.array([np.sin(angle) * _AWAY, -_ABOVE, -np.cos(angle) * _AWAY])
        ahead = -away / np.linalg.norm(away)
        right = np.cross([0.0, 1.0, 0.0], ahead)
        right = right / np.linalg.norm(right)
        pose[:3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=1)
        pose[:3, 3] = middle + reach_m * away
    return Trajectory(poses, np.arange(_AROUND) / _RATE_HZ)


def _given(cameras: Path) -> tuple[Trajectory, tuple[Camera, ...], str]:
    """The path and the pinholes of a file or a folder, and what they are."""
    if not cameras.is_dir():
        drive = read_trajectory(cameras)
        said = f"Its cameras are the poses of {cameras}, with a pinhole of 60 degrees: poses have none."
        return drive, (_PINHOLE,) * len(drive), said
    model = find_colmap(cameras)
    if model is None:
        raise InputError(f"--cameras {cameras} holds no COLMAP model; expected cameras, images and points3D")
    found: Any = read_colmap(model)
    images: list[Any] = sorted(
        (each for each in found.images.values() if each.has_pose), key=lambda i: i.name
    )
    if not images:
        raise InputError(f"--cameras {model}: the COLMAP model has no views")
    lenses = {k: colmap_camera(each, str(model)) for k, each in found.cameras.items()}
    poses = clean_poses(_world_from(images), str(model), lambda row: str(images[row].name))
    bent = any(lenses[each.camera_id].distortion is not None for each in images)
    said = f"Its cameras are the {len(images)} views of {model}" + (", without their lens." if bent else ".")
    pinholes = tuple(lenses[each.camera_id].camera for each in images)
    return Trajectory(poses, np.arange(len(images)) / _RATE_HZ), pinholes, said


def _world_from(images: list[Any]) -> Float[np.ndarray, "f 4 4"]:
    poses = np.tile(np.eye(4), (len(images), 1, 1))
    for pose, image in zip(poses, images, strict=True):
        pose[:3] = image.cam_from_world().inverse().matrix()
    return poses
