"""What a drawn street truly is, in the terms of the stages: depth, labels, tracks."""

from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Bool, Int
from scipy.spatial.transform import Rotation

from dreamdrive.decompose import Grouping, Path, Placement, source_pixels
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.similarity import fit_similarity
from dreamdrive.scene.street.truth import DriveTruth, WorldBox

_UP = np.array([0.0, -1.0, 0.0])  # where no road tells it


def with_true_depth(
    geometry: Geometry, clip: Clip, made: DriveTruth, *, standing: bool, moving: bool
) -> Geometry:
    """The true depth, fully trusted, of what stands, of what moves, or of both; with the former the true sky.

    Depth is in metres of the geometry's own world.
    """
    scale = fit_similarity(geometry.cameras, made.cameras).scale
    chosen = np.where(made.moving, moving, standing) & ~clip.held_out[:, None, None]
    depth_m = np.where(chosen, made.depth_m / scale, geometry.depth_m).astype(np.float32)
    seen = made.sky & ~clip.held_out[:, None, None]
    sky = seen if standing else geometry.sky & ~(chosen & (made.depth_m > 0))
    return replace(
        geometry,
        depth_m=np.where(sky, 0, depth_m).astype(np.float32),
        confidence=np.where(chosen & ~sky, 1, np.where(sky, 0, geometry.confidence)).astype(np.float32),
        sky=sky,
    )


def instances_of(made: DriveTruth, geometry: Geometry, seeds: Gaussians) -> Int[np.ndarray, " n"]:
    """The instance that moves at the pixel of each seed (N,), 0 where none does."""
    pixels = source_pixels(geometry, seeds, np.arange(len(seeds)))
    height, width = made.instance.shape[1:]
    column, row = np.floor(pixels[:, :2]).astype(int).T
    at = seeds.source_frame.numpy(), row.clip(0, height - 1), column.clip(0, width - 1)
    return np.where(made.moving[at], made.instance[at], 0)


def true_labels(made: DriveTruth, geometry: Geometry, seeds: Gaussians) -> Grouping:
    """What moves, a cluster each."""
    instances = instances_of(made, geometry, seeds)
    _, cluster = np.unique(instances, return_inverse=True)
    cluster = cluster.reshape(-1) - (instances == 0).any()
    return Grouping(torch.from_numpy(cluster >= 0), torch.from_numpy(cluster.astype(np.int64)))


def true_paths(
    made: DriveTruth, geometry: Geometry, clip: Clip, seeds: Gaussians, labels: Grouping
) -> dict[int, Path]:
    """The path of the box that most of a cluster's seeds are of; clusters of what stands have none."""
    instances, cluster = instances_of(made, geometry, seeds), labels.cluster.numpy()
    boxes = {box.instance: box for box in made.boxes}
    found: dict[int, Path] = {}
    for c in range(int(cluster.max(initial=-1)) + 1):
        count = np.bincount(instances[cluster == c])
        if int(count.argmax()) > 0:
            seen = np.bincount(seeds.source_frame.numpy()[cluster == c], minlength=len(clip))
            found[c] = _path(made, boxes[int(count.argmax())], geometry, ~clip.held_out, seen)
    return found


def _path(
    made: DriveTruth,
    box: WorldBox,
    geometry: Geometry,
    used: Bool[np.ndarray, " f"],
    seeds: Int[np.ndarray, " f"],
) -> Path:
    similarity = fit_similarity(geometry.cameras, made.cameras)
    poses = box.world_from_box[used]
    place_m = (poses[:, :3, 3] - similarity.translation) @ similarity.rotation / similarity.scale
    turns = similarity.rotation.T @ poses[:, :3, :3]
    up = _UP if geometry.ground is None else geometry.ground.normal_world
    middle = len(poses) // 2
    yaw = Rotation.from_matrix(turns @ turns[middle].T).as_rotvec() @ up
    return Path(
        np.flatnonzero(used),
        Placement(place_m, np.unwrap(yaw), np.ones(len(poses)), np.zeros(len(poses)), turns[middle, :, 0]),
        up,
        tuple(np.ones(count) for count in seeds[used]),
    )
