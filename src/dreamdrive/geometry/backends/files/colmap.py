"""COLMAP's sparse models, binary or text.

COLMAP writes camera_from_world with x right, y down, z forward, as we do, and counts pixels from the corner
of the picture (the first pixel's centre is 0.5), as we do: the pose is inverted, nothing else. The unit of a
model is arbitrary. Depth may lie in a folder ``depth`` in the model's folder, called like the images.
"""

from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from jaxtyping import Int

from dreamdrive.data.camera_models import find_colmap, from_colmap, read_colmap
from dreamdrive.data.pose_files import clean_poses
from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.files.cameras import different
from dreamdrive.geometry.backends.files.declared import read_declared
from dreamdrive.geometry.backends.files.depth import find_depth
from dreamdrive.geometry.backends.files.given import Given, SparsePoints
from dreamdrive.geometry.backends.files.wanted import Wanted

MAX_POINTS = 20_000
"""Points that are kept, those seen most often: enough for the road and for the scale."""


def read_colmap_model(path: Path, wanted: Wanted) -> Given:
    """Read a COLMAP model; pictures that were not registered count as missing.

    Args:
        path: The folder that was given; the model lies in it, or in its ``sparse/0``.
        wanted: The frames to look for.

    Raises:
        InputError: The model is damaged, lacks a frame, or has a lens that is not known.
    """
    folder = find_colmap(path) or path
    model = read_colmap(folder)
    images = [image for _, image in sorted(model.images.items()) if image.has_pose]
    if not images:
        raise InputError(f"{folder}: the COLMAP model has no picture with a pose")
    rows, notes = wanted.rows([image.name for image in images], str(folder))
    chosen = [images[row] for row in rows]
    from_world = np.tile(np.eye(4), (len(chosen), 1, 1))
    from_world[:, :3] = [image.cam_from_world().matrix() for image in chosen]
    # Cleaned first: an inverse by the transpose wants true rotations.
    from_world = clean_poses(from_world, str(folder), lambda row: f"the pose of {chosen[row].name}")
    found = [from_colmap(model.cameras[image.camera_id], str(folder)) for image in chosen]
    cameras, camera = different(found)
    declared = read_declared(path)
    stems = [PurePosixPath(image.name).stem for image in chosen]
    return Given(
        np.linalg.inv(from_world),
        metric=declared.metric is True,
        cameras=cameras,
        camera=camera,
        depth=find_depth(path / "depth", stems, declared),
        sparse=_sparse(model, np.array([image.image_id for image in chosen])),
        notes=notes,
    )


def _sparse(model: Any, image_ids: Int[np.ndarray, " f"]) -> SparsePoints | None:
    longest = sorted(model.points3D.items(), key=lambda item: (-item[1].track.length(), item[0]))
    row = {int(image): frame for frame, image in enumerate(image_ids)}
    kept: list[np.ndarray] = []
    seen: list[list[int]] = []
    for _, point in longest[:MAX_POINTS]:
        frames = [row[e.image_id] for e in point.track.elements if e.image_id in row]
        if frames and np.isfinite(point.xyz).all():
            kept.append(np.array(point.xyz))
            seen.append(frames)
    if not kept:
        return None
    mask = np.zeros((len(image_ids), len(kept)), bool)
    for index, frames in enumerate(seen):
        mask[frames, index] = True
    return SparsePoints(np.array(kept), mask)
