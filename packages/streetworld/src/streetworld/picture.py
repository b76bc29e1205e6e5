"""Pictures of a street, with the truth behind every pixel."""

import numpy as np

from dreamdrive.scene.camera import Camera
from streetworld.editions import edition_of
from streetworld.engine.eye import Eye
from streetworld.engine.street import Moment, Street
from streetworld.engine.view import WorldView

# Places of the further rays inside a pixel, about its centre.
_RAYS = np.array([[-0.125, -0.375], [0.375, -0.125], [0.125, 0.375], [-0.375, 0.125]])
_CONTRAST = 0.07  # of encoded brightness, from which on a pixel takes further rays
_SHOULDER = 0.75


def picture_of(
    world: Street,
    moment: Moment,
    camera: Camera,
    following: tuple[float, Camera],
    *,
    antialiased: bool = True,
) -> WorldView:
    """The picture of a camera in the map frame, and the flow to where another time and camera see the same.

    Antialiased, pixels that differ from their neighbours take four further rays.
    """
    shape = camera.height_px, camera.width_px
    eye = edition_of(world.layout).eye(world, moment, camera)
    columns, rows = (g.ravel() + 0.5 for g in np.meshgrid(np.arange(shape[1]), np.arange(shape[0])))
    rays = eye.rays(columns, rows)
    hits = eye.trace(rays, columns, rows)
    colour = eye.shade(rays, hits)
    if antialiased:
        _refine(eye, colour, columns, rows, shape)
    colour = eye.behind_glass(colour, hits)
    frame = _encoded(colour * np.float32(world.exposure(moment.time_s)))
    view = WorldView(
        frame=np.rint(255 * frame).astype(np.uint8).reshape(*shape, 3),
        depth_m=np.where(hits.triangle >= 0, hits.distance, 0).astype(np.float32).reshape(shape),
        instance=eye.instances(hits).reshape(shape),
        semantic=eye.semantics(rays, hits).reshape(shape),
        moving=(hits.triangle >= len(world.standing)).reshape(shape),
        flow_px=eye.flow(rays, hits, columns, rows, following).astype(np.float32).reshape(*shape, 2),
    )
    return eye.completed(view)


def _refine(
    eye: Eye, colour: np.ndarray, columns: np.ndarray, rows: np.ndarray, shape: tuple[int, int]
) -> None:
    """Give pixels that differ from a neighbour the mean over further rays, in place."""
    seen = _encoded(colour).T.mean(axis=0).reshape(shape)
    uneven = np.zeros(shape, dtype=bool)
    for view, grey in ((uneven, seen), (uneven.T, seen.T)):
        step = np.abs(np.diff(grey, axis=0)) > _CONTRAST
        view[:-1] |= step
        view[1:] |= step
    chosen = np.flatnonzero(uneven.ravel())
    across = (columns[chosen] + _RAYS[:, :1]).ravel()
    down = (rows[chosen] + _RAYS[:, 1:]).ravel()
    rays = eye.rays(across, down)
    further = eye.shade(rays, eye.trace(rays, across, down)).T.reshape(3, len(_RAYS), len(chosen))
    # Bright points are cut before they are averaged, as they are in the pixels that take one ray.
    colour[chosen] = np.minimum(further, 1.5).mean(axis=1).T


def _encoded(colour: np.ndarray) -> np.ndarray:
    """Linear light to display brightness in [0, 1]: a soft shoulder, then gamma 2."""
    above = np.maximum(colour - _SHOULDER, 0)
    soft = np.minimum(colour, _SHOULDER) + (1 - _SHOULDER) * (1 - np.exp(-above / (1 - _SHOULDER)))
    return np.sqrt(np.maximum(soft, 0))
