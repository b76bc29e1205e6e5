"""Holes in views from aside, filled from around."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, Int

from dreamdrive.complete.surface import surface
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene

_SOLID_ALPHA = 0.5
_COARSER = 2  # than the recording are views that holes are looked for in: a guess is no finer
_LEAST_PX = 3
_AROUND_PX = 2.5
_SAME = 0.8  # of the depth of a hole, from which on what lies beside it goes on there
_OPAQUE = 0.9
_BEHIND = 0.99  # of the depth that a view sees there


@torch.no_grad()
def without_holes(
    scene: Scene,
    geometry: Geometry,
    views: Sequence[int],
    shifts_m: Sequence[float],
    users: Bool[torch.Tensor, " n"],
    device: torch.device,
) -> Scene:
    """The scene with the holes of recorded views filled that are moved to the right, one after the other.

    What a recorded view looks through stays free. What is of road users, ``users``, does not go on.

    A hole is what Gaussians cover less than half of, where the view from the path shows no sky: what is far
    is at the same pixel there. Depth is that of the farther side in each row, for what is nearer ends there,
    and the road at most. That side goes on as its mirror image, else colours are inpainted (Telea 2004).
    """
    there = scene.on(device)
    seen = [_Recorded.of(there, view) for view in np.flatnonzero(~scene.held_out).tolist()]
    for view in reversed(views):
        for shift_m in shifts_m:
            camera = _coarse(scene.cameras[view]).moved(shift_m)
            added = _filling(scene.on(device), geometry, camera, view, users)
            if added is not None:
                hidden = np.all([each.hides(added.means.double().numpy()) for each in seen], axis=0)
                scene = scene.with_standing(added.select(torch.from_numpy(np.flatnonzero(hidden))))
    return scene


@dataclass(frozen=True)
class _Recorded:
    """A recorded view, and how far it sees (H, W): as far as something stands, or without end."""

    camera: Camera
    depth_m: Float[np.ndarray, "h w"]

    @staticmethod
    def of(scene: Scene, view: int) -> "_Recorded":
        camera = scene.cameras[view]
        seen = render_scene(scene, camera, float(scene.times_s[view]), exposure=False, part="static")
        far = torch.where(seen.alpha > _OPAQUE, seen.depth_m, torch.inf).numpy()
        # What is put at an outline would reach out of it.
        return _Recorded(camera, cv2.dilate(far, np.ones((3, 3), np.uint8)))

    def hides(self, places: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Which places it does not see: outside of it, or behind what stands."""
        at = self.camera.project(places)
        inside = self.camera.shows(at)
        hidden = ~inside
        columns, rows = at[inside, :2].astype(int).T
        hidden[inside] = at[inside, 2] > _BEHIND * self.depth_m[rows, columns]
        return hidden


def _coarse(camera: Camera) -> Camera:
    """The same view at the resolution of guesses."""
    return camera.resized(max(1, camera.width_px // _COARSER), max(1, camera.height_px // _COARSER))


def _filling(
    scene: Scene, geometry: Geometry, camera: Camera, view: int, users: Bool[torch.Tensor, " n"]
) -> Gaussians | None:
    """Gaussians for the holes of a view; None where there are none, or nothing is around them."""
    marks = torch.zeros(len(scene.static), 1)
    marks[: len(users), 0] = users.float()
    t_s = float(scene.times_s[view])
    seen = render_scene(scene, camera, t_s, exposure=False, part="static", channels=marks)
    depth_m, alpha = seen.depth_m.numpy(), seen.alpha.numpy()
    sky = cv2.resize(geometry.sky[view].astype(np.uint8), alpha.shape[::-1], interpolation=cv2.INTER_NEAREST)
    hole = (alpha < _SOLID_ALPHA) & (sky == 0)
    if hole.sum() < _LEAST_PX:
        return None
    wide = cv2.dilate(hole.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    user = seen.channels[..., 0].numpy() > _SOLID_ALPHA
    known = ~wide & ~user & (alpha > _SOLID_ALPHA) & (depth_m > 0)
    z_m, beside = _behind(depth_m, known, hole)
    if geometry.ground is not None:
        z_m = np.minimum(z_m, geometry.ground.depth_m(camera))
    rows, columns = np.nonzero(hole & np.isfinite(z_m))
    if not len(rows):
        return None
    mirrored = 2 * beside[rows, columns] - columns
    inside = mirrored.clip(0, hole.shape[1] - 1)
    there = (mirrored == inside) & known[rows, inside] & (depth_m[rows, inside] > _SAME * z_m[rows, columns])
    picture = seen.picture
    picture[rows[there], columns[there]] = picture[rows[there], inside[there]]
    wide[rows[there], columns[there]] = False
    picture = cv2.inpaint(picture, (wide | user).astype(np.uint8), _AROUND_PX, cv2.INPAINT_TELEA)
    pixels = np.column_stack([columns + 0.5, rows + 0.5, z_m[rows, columns]])
    return surface(camera, pixels, picture[rows, columns] / 255.0, view)


def _behind(
    depth_m: Float[np.ndarray, "h w"], known: Bool[np.ndarray, "h w"], hole: Bool[np.ndarray, "h w"]
) -> tuple[Float[np.ndarray, "h w"], Int[np.ndarray, "h w"]]:
    """Depth of the farther of the nearest known pixels to the left and right, and the column of that pixel.

    NaN where a row has none.
    """
    width = depth_m.shape[1]
    columns = np.broadcast_to(np.arange(width), depth_m.shape)
    left = np.maximum.accumulate(np.where(known, columns, -1), axis=1)
    right = np.minimum.accumulate(np.where(known, columns, width)[:, ::-1], axis=1)[:, ::-1]
    by_side = [
        np.where(there, np.take_along_axis(depth_m, np.where(there, side, 0), axis=1), 0)
        for side, there in ((left, left >= 0), (right, right < width))
    ]
    beside = np.where(by_side[0] >= by_side[1], left, right)
    found = np.maximum(*by_side)
    return np.where(hole & (found > 0), found, np.nan), beside
