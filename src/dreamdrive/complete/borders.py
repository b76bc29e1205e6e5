"""What the borders of pictures cut off: made of what lies inside of them, mirrored along the road."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Int

from dreamdrive.complete.mirror import plain, road_user_of, turned, unseen
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene

_NEAREST_M, _FARTHEST_M = 0.3, 60.0
_FREE_M = 4.5  # beside the path no copy stands: views aside drive there
_NEAR_M = 8.0  # beside the path copies are walls alone: so near to views aside a tree is tufts
_WALL_M, _WALL = 0.5, 0.75  # thick, and the share of what stands near that is one
_LOW_M = 0.3  # above the road: what lies on it
_CELL_M = 0.5
_MOST_CELLS = 1 << 20  # along an axis
_SOFT = 0.3  # share of the length over which it ends


@dataclass(frozen=True)
class Border:
    """One side of a view: the axes of the road there, and where the picture ends.

    A point ``x`` m aside is in the picture from ``x / slope`` m ahead on.
    """

    place: Float[np.ndarray, "3"]
    ahead: Float[np.ndarray, "3"]
    aside: Float[np.ndarray, "3"]
    slope: float

    @staticmethod
    def of(camera: Camera, up: Float[np.ndarray, "3"], side: int) -> "Border":
        """The right border of a view with side 1, the left one with -1."""
        pose = camera.world_from_camera
        ahead = pose[:3, 2] - up * (pose[:3, 2] @ up)
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, up)
        right *= np.sign(right @ pose[:3, 0])
        reach_px = camera.width_px - camera.cx_px if side > 0 else camera.cx_px
        return Border(pose[:3, 3], ahead, side * right, reach_px / camera.fx_px)


def beyond_borders(scene: Scene, geometry: Geometry, views: Sequence[int], length_m: float) -> Scene:
    """The scene with what stands beyond the borders of views, as far as no view shows the place.

    A point as far ahead of the border as a place is behind it, at the same distance from the path, stands in
    for what is there: road goes on as road and a facade in its plane, without an edge at the border. Road
    users are left out, see ``vehicles``: they would be cut twice.
    """
    source = _source(scene, geometry)
    taken = np.empty(0, np.int64)
    for view in views:
        for side in (1, -1):
            border = Border.of(scene.cameras[view], scene.up, side)
            added = _chosen(_mirrored(source, border, length_m), taken, scene, geometry)
            if len(added):
                taken = np.union1d(taken, _cells(added))
                scene = scene.with_standing(added)
    return scene


def _chosen(added: Gaussians, taken: Int[np.ndarray, " m"], scene: Scene, geometry: Geometry) -> Gaussians:
    """Those that no view shows, in cells that are not taken yet and off the way; the dear test comes last."""
    added = added.select(torch.from_numpy(np.flatnonzero(_off_the_way(added, scene, geometry))))
    added = added.select(torch.from_numpy(np.flatnonzero(~np.isin(_cells(added), taken))))
    return added.select(torch.from_numpy(np.flatnonzero(unseen(added, scene.cameras))))


def _source(scene: Scene, geometry: Geometry) -> Gaussians:
    """What stands and is no road user."""
    source = plain(scene.static)
    return source.select(torch.from_numpy(np.flatnonzero(road_user_of(source, geometry) == 0)))


def _mirrored(source: Gaussians, border: Border, length_m: float) -> Gaussians:
    """What lies within a length inside of the border, at as much beyond it."""
    away = source.means.double().numpy() - border.place
    aside, ahead = away @ border.aside, away @ border.ahead
    inside = ahead - aside / border.slope
    rows = np.flatnonzero((aside > _NEAREST_M) & (aside < _FARTHEST_M) & (inside >= 0) & (inside < length_m))
    found, beyond = source.select(torch.from_numpy(rows)), inside[rows]
    places = away[rows] + border.place - 2 * beyond[:, None] * border.ahead
    fading = np.clip((1 - beyond / length_m) / _SOFT, 0.02, 1)
    opacity = torch.sigmoid(found.logit_opacities) * torch.from_numpy(fading).float()
    return replace(
        found,
        means=torch.from_numpy(places).float(),
        quaternions=turned(found.quaternions.double().numpy(), border.ahead),
        logit_opacities=torch.logit(opacity.clamp(1e-4, 1 - 1e-4)),
        filled=torch.ones(len(found), dtype=torch.bool),
    )


def _off_the_way(added: Gaussians, scene: Scene, geometry: Geometry) -> Bool[np.ndarray, " n"]:
    """What lies on the road, is a wall, or is so far from the path that views aside pass it."""
    places, ground = added.means.double().numpy(), geometry.ground
    low = np.zeros(len(added), bool) if ground is None else np.abs(ground.height_m(places)) < _LOW_M
    path = scene.trajectory.world_from_camera[:, :3, 3]
    flat = np.eye(3) - np.outer(scene.up, scene.up)
    away = np.min([np.linalg.norm((places - each) @ flat, axis=1) for each in path], axis=0)
    near = ~low & (away > _FREE_M) & (away < _NEAR_M)
    kept = low | (away >= _NEAR_M)
    kept[near] = _in_a_wall(away[near])
    return kept


def _in_a_wall(away_m: Float[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Which of what is so far beside the path is one wall along it; none where there is no wall."""
    slices = (away_m / _WALL_M).astype(int)
    counts = np.bincount(slices, minlength=1)
    inside = np.abs(slices - counts.argmax()) <= 1
    return inside & (inside.sum() >= _WALL * len(away_m))


def _cells(gaussians: Gaussians) -> Int[np.ndarray, " n"]:
    """The cell of space that each is in, as one number."""
    steps = np.floor(gaussians.means.double().numpy() / _CELL_M).astype(np.int64)
    return (steps & _MOST_CELLS - 1) @ np.array([1, _MOST_CELLS, _MOST_CELLS**2])
