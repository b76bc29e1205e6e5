"""A start brought to cameras that are known."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from dreamdrive.geometry.backends.dust3r.align.spanning_tree import BASE_SCALE, Start
from dreamdrive.geometry.cameras import register
from dreamdrive.scene.similarity import Similarity

_STANDING = 1e-9


def onto_known(
    start: Start, world_from_camera: Float[np.ndarray, "n 4 4"]
) -> tuple[Start, Float[np.ndarray, "n 4 4"]]:
    """The start in the known world, and the known poses in the unit in which the pairs' scales average 0.5.

    The unit is not that of the known poses: were the scales of pairs free, the loss could fall while the
    clouds shrink. One factor between the two is left for the solver.
    """
    similarity = register(
        _marks(start.world_from_camera), _marks(world_from_camera), np.ones(4 * len(world_from_camera))
    )
    scales = np.array([similarity.scale * pair.scale for pair in start.pairs])
    unit = float(BASE_SCALE / np.exp(np.log(scales).mean()))
    pairs = tuple(
        Similarity(
            unit * similarity.scale * pair.scale,
            similarity.rotation @ pair.rotation,
            unit * similarity(pair.translation),
        )
        for pair in start.pairs
    )
    poses = world_from_camera.astype(np.float64)
    poses[:, :3, 3] *= unit
    depth = tuple((unit * similarity.scale * each).astype(each.dtype) for each in start.depth)
    return replace(start, world_from_camera=poses, pairs=pairs, depth=depth), poses


def _marks(poses: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "m 3"]:
    """Centres, and points along all axes as far out as these spread: a straight path alone leaves a roll."""
    centres = poses[:, :3, 3]
    spread = float(np.sqrt(np.square(centres - centres.mean(axis=0)).sum(axis=1).mean()))
    reach = spread if spread > _STANDING else 1.0
    axes = [centres + reach * poses[:, :3, axis] for axis in range(3)]
    return np.concatenate([centres, *axes])
