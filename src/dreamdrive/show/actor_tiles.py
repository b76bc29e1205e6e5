"""A picture of each actor of a scene, cut out where it is seen largest."""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.errors import InputError
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.show import panels
from dreamdrive.show.ids import outline
from dreamdrive.splat import render_scene

_SIDE_PX, _COLUMNS, _AROUND = 160, 6, 1.4
_LEAST_PX = 24
"""Side of what is cut out: smaller ones show the street around them."""


def draw_actors(scene: Scene) -> UInt8[np.ndarray, "h w 3"]:
    """A tile for each actor, with its id and what it is; ``InputError`` where there is none."""
    if not scene.actors:
        raise InputError("nothing in this scene moves on a track: there is no actor to draw")
    tiles = {f"{actor.id} {actor.kind}": _tile(scene, actor) for actor in scene.actors}
    return panels.grid(tiles, min(_COLUMNS, len(tiles)))


def best_view(scene: Scene, actor: Actor) -> tuple[int, Float[np.ndarray, "4"]]:
    """The recorded view that sees it largest, and where: left, top, right, bottom in pixels.

    Where no view sees it, the middle one in which it is there, and all of the picture.
    """
    first_s, last_s = actor.track.first_s - 1e-6, actor.track.last_s + 1e-6
    there = [i for i, t_s in enumerate(scene.times_s.tolist()) if first_s <= t_s <= last_s]
    views = there or list(range(len(scene.cameras)))
    boxes = {i: _box(scene, actor, scene.cameras[i], float(scene.times_s[i])) for i in views}
    seen = {i: box for i, box in boxes.items() if box is not None}
    if not seen:
        camera = scene.cameras[views[len(views) // 2]]
        return views[len(views) // 2], np.array([0.0, 0.0, camera.width_px, camera.height_px])
    best = max(seen, key=lambda i: float((seen[i][2:] - seen[i][:2]).sum()))
    return best, seen[best]


def _box(scene: Scene, actor: Actor, camera: Camera, t_s: float) -> Float[np.ndarray, "4"] | None:
    """What a camera shows of it; None where its middle is not in the picture."""
    projected = camera.project(outline(actor, scene.up, t_s))
    if not camera.shows(projected.mean(axis=0)[None])[0] or (projected[:, 2] <= 0).any():
        return None
    low, high = projected[:, :2].min(axis=0), projected[:, :2].max(axis=0)
    size = np.array([camera.width_px, camera.height_px])
    return np.concatenate([low.clip(0, size), high.clip(0, size)])


def _tile(scene: Scene, actor: Actor) -> UInt8[np.ndarray, "h w 3"]:
    view, box = best_view(scene, actor)
    t_s = float(scene.times_s[view])
    picture = render_scene(scene, scene.cameras[view], t_s, of_rig=scene.of_rig(view)).picture
    middle, side = (box[:2] + box[2:]) / 2, max(_LEAST_PX, _AROUND * float((box[2:] - box[:2]).max()))
    side = min(side, *picture.shape[:2])
    low = np.clip(middle - side / 2, 0, np.array(picture.shape[1::-1]) - side).astype(int)
    cut = picture[low[1] : low[1] + round(side), low[0] : low[0] + round(side)]
    how = cv2.INTER_AREA if side > _SIDE_PX else cv2.INTER_CUBIC
    return cv2.resize(cut, (_SIDE_PX, _SIDE_PX), interpolation=how)
