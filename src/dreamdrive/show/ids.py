"""Ids of what moves, written where it is: as ``render --without`` takes them."""

import cv2
import numpy as np
from jaxtyping import Float

from dreamdrive.scene.actor import Actor
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.show.panels import Image

_SMALL_M = 1.5
"""Size of what has no box."""
_SLACK_S = 1e-6


def with_ids(picture: Image, scene: Scene, camera: Camera, t_s: float) -> Image:
    """A copy of what a camera shows at a time, with the id of each actor above what is seen of it."""
    marked = picture.copy()
    up = scene.up
    for actor in scene.actors:
        if actor.track.first_s - _SLACK_S <= t_s <= actor.track.last_s + _SLACK_S:
            projected = camera.project(outline(actor, up, t_s))
            seen = projected[camera.shows(projected)]
            if len(seen):
                x, y = np.rint([seen[:, 0].mean(), seen[:, 1].min()]).astype(int).tolist()
                _write(marked, str(actor.id), x, y)
    return marked


def outline(actor: Actor, up: Float[np.ndarray, "3"], t_s: float) -> Float[np.ndarray, "6 3"]:
    """Its back, middle and front, at the bottom and at the top."""
    track, box = actor.track.at(np.array([t_s])), actor.box
    long_m, tall_m = (0.0, _SMALL_M) if box is None else (box.size_m[0], box.size_m[2])
    ahead = np.zeros(3) if box is None else box.pointing(float(track.yaw_rad[0]), up)
    points = [along * long_m * ahead + high * tall_m * up for high in (0, 1) for along in (-0.5, 0, 0.5)]
    return track.positions_m[0] + np.stack(points)


def _write(picture: Image, text: str, x: int, y: int) -> None:
    """White on a dark box around a place, inside the picture."""
    scale = max(0.35, picture.shape[0] / 800)
    (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)
    x = min(max(x - width // 2, 2), picture.shape[1] - width - 2)
    y = min(max(y, height + 3), picture.shape[0] - 3)
    cv2.rectangle(picture, (x - 2, y - height - 2), (x + width + 1, y + 2), (0, 0, 0), -1)
    cv2.putText(picture, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, scale, (255, 255, 255), 1, cv2.LINE_AA)
