"""How notebooks show scenes, looks, trajectories and outcomes: a picture and a few numbers, as HTML."""

from base64 import b64encode
from collections import Counter
from collections.abc import Mapping
from html import escape
from math import degrees
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float

from dreamdrive.data.pictures.picture_file import read_picture
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.look import Look
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.show.look import COLOURS
from dreamdrive.show.panels import Image, depth_colours
from dreamdrive.show.rendering import view_camera
from dreamdrive.splat import render_scene

_WIDTH_PX = 360
"""Width of one picture of a scene or a look, of which two stand side by side."""
_MAP_PX, _MARGIN_PX = 320, 24
_COLUMN_PX, _QUALITY = 900, 85
_LEFT = 'style="text-align:left"'
_NEAR, _FAR = 1.5, 60.0
"""Camera heights at the ends of the colours of depth."""


def card(title: str, rows: Mapping[str, str], picture: Image | None = None) -> str:
    """A title, a table of two columns and a picture inside the text, as HTML; texts are escaped."""
    cells = "".join(
        f"<tr><th {_LEFT}>{escape(name)}</th><td {_LEFT}>{escape(text)}</td></tr>"
        for name, text in rows.items()
    )
    image = "" if picture is None else f'<img src="{_data_uri(picture)}" alt="{escape(title)}">'
    return f"<div><b>{escape(title)}</b><br>{image}<table>{cells}</table></div>"


def small_picture(path: Path) -> Image:
    """A picture of a folder, at most as wide as a notebook's column."""
    picture = cv2.cvtColor(read_picture(path), cv2.COLOR_BGR2RGB)
    share = min(1.0, _COLUMN_PX / picture.shape[1])
    return cv2.resize(picture, None, fx=share, fy=share, interpolation=cv2.INTER_AREA)


def of_scene(scene: Scene) -> str:
    """The middle view of the recorded drive with its depth; Gaussians, actors, path."""
    view = int(scene.front[len(scene.front) // 2])
    camera = scene.cameras[view]
    height = max(2, round(_WIDTH_PX * camera.height_px / camera.width_px))
    seen = render_scene(
        scene, view_camera(camera, (_WIDTH_PX, height)), float(scene.times_s[view]), of_rig=scene.of_rig(view)
    )
    path = scene.trajectory
    rows = {
        "Gaussians": f"{len(scene.static):,} of what stands, {len(scene.dynamic):,} of what moves",
        "actors": ", ".join(actor.name for actor in scene.actors) or "none",
        "recorded": f"{len(scene.cameras)} views, {int(scene.held_out.sum())} held out; {_drive(path)}",
        "metres": scene.provenance.scale or "not known what they rest on",
    }
    return card("Scene", rows, np.hstack([seen.picture, depth_colours(seen.depth_m.numpy())]))


def of_look(look: Look) -> str:
    """Classes and depth of the first frame; the camera, and the road users of all frames."""
    classes = np.zeros((*look.classes.shape[1:], 3), np.uint8)
    for each, colour in COLOURS.items():
        classes[look.classes[0] == each] = colour
    both = np.hstack([classes, depth_colours(look.depth[0], _NEAR, _FAR)])
    height = max(1, round(2 * _WIDTH_PX * both.shape[0] / both.shape[1]))
    kinds = Counter(StreetClass(user.kind).name.lower() for users in look.road_users for user in users)
    height_m = look.camera_height_m
    rows = {
        "frames": f"{len(look)} of {look.depth.shape[2]} x {look.depth.shape[1]} pixels",
        "camera": f"field of view {degrees(look.camera.hfov_rad):.0f}°, "
        f"looks up {degrees(look.camera.pitch_rad):.1f}°",
        "depth in": "camera heights" if height_m is None else f"heights of {height_m:g} m",
        "road users": ", ".join(f"{count} x {kind}" for kind, count in kinds.items()) or "none",
    }
    return card("Look", rows, cv2.resize(both, (2 * _WIDTH_PX, height), interpolation=cv2.INTER_NEAREST))


def of_trajectory(path: Trajectory) -> str:
    """The path from above, the first camera looking up; its length, time and speed."""
    rows = {"poses": str(len(path)), "drive": _drive(path)}
    return card("Trajectory", rows, _from_above(path.world_from_camera))


def _drive(path: Trajectory) -> str:
    seconds = float(path.times_s[-1] - path.times_s[0])
    speed = f", {3.6 * path.length_m / seconds:.0f} km/h in the mean" if seconds else ""
    return f"{path.length_m:.1f} m in {seconds:.2f} s{speed}"


def _from_above(poses: Float[np.ndarray, "t 4 4"]) -> Image:
    """Places and directions of cameras, x to the right and z up the picture; the scale is told."""
    first = np.linalg.inv(poses[0]) @ poses
    places, ahead = first[:, [0, 2], 3], first[:, [0, 2], 2]
    span_m = max(float(np.ptp(places, axis=0).max()), 1.0)
    scale = (_MAP_PX - 2 * _MARGIN_PX) / span_m
    middle = (places.min(axis=0) + places.max(axis=0)) / 2

    def pixels(points: Float[np.ndarray, "n 2"]) -> list[tuple[int, int]]:
        moved = (points - middle) * [scale, -scale] + _MAP_PX / 2
        return [(int(x), int(y)) for x, y in np.rint(moved)]

    picture = np.full((_MAP_PX, _MAP_PX, 3), 255, np.uint8)
    looking = pixels(places + ahead * (0.6 * _MARGIN_PX / scale))
    for (start, end), tip in zip(
        zip(pixels(places), pixels(places)[1:] + pixels(places)[-1:], strict=True), looking, strict=True
    ):
        cv2.line(picture, start, tip, (170, 200, 240), 1, cv2.LINE_AA)
        cv2.line(picture, start, end, (200, 40, 40), 2, cv2.LINE_AA)
    cv2.circle(picture, pixels(places)[0], 4, (30, 120, 30), -1, cv2.LINE_AA)
    told = f"{span_m:.1f} m"
    cv2.putText(picture, told, (6, _MAP_PX - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1, cv2.LINE_AA)
    return picture


def _data_uri(picture: Image) -> str:
    """A picture inside a text, as JPEG."""
    done, data = cv2.imencode(
        ".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
    )
    assert done
    return f"data:image/jpeg;base64,{b64encode(data.tobytes()).decode()}"
