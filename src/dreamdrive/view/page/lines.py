"""Lines over the picture: the recorded drive and its views, tracks and boxes of actors."""

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation
from viser import ClientHandle, SceneNodeHandle

from dreamdrive.scene.actor import Actor
from dreamdrive.scene.scene import Scene
from dreamdrive.view.road_path import height_m
from dreamdrive.view.session import vertical_fov_rad

DRIVE, VIEW, TRACK, CHOSEN = (70, 150, 255), (120, 180, 255), (255, 190, 60), (255, 90, 60)
"""Colours of the recorded drive, its views, and of actors, and of the picked one."""
MOST_VIEWS = 40
_SMALL_M = 1.5
_SLACK_S = 1e-3
_LINE_M, _RIBBON_M, _VIEW_M = 0.04, 0.25, 0.2


class Lines:
    """What lies over the picture of one browser."""

    def __init__(
        self, client: ClientHandle, scene: Scene, pick: Callable[[int], None], jump: Callable[[int], None]
    ) -> None:
        self._client, self._up, self._pick = client, scene.up, pick
        self._views: list[SceneNodeHandle] = []
        self._boxes: dict[int, tuple[Actor, list[SceneNodeHandle]]] = {}
        self._tracks: list[SceneNodeHandle] = []
        self._shown = True
        if not scene.moves_per_frame:
            self._draw_views(scene, jump)

    def _draw_views(self, scene: Scene, jump: Callable[[int], None]) -> None:
        add, down = self._client.scene, height_m(scene) * scene.up
        road = scene.trajectory.positions_m - down
        if len(road) > 1:
            points = np.stack([road[:-1], road[1:]], axis=1)
            self._views.append(add.add_line_segments("/drive", points, DRIVE, thickness=_LINE_M))
        for view in range(0, len(scene.cameras), -(-len(scene.cameras) // MOST_VIEWS)):
            camera = scene.cameras[view]
            aspect = camera.width_px / camera.height_px
            handle = add.add_camera_frustum(
                f"/views/{view}", vertical_fov_rad(camera), aspect, scale=_VIEW_M, color=VIEW, thickness=0.01,
                wxyz=wxyz(camera.world_from_camera[:3, :3]), position=camera.world_from_camera[:3, 3],
            )  # fmt: skip
            handle.on_click(_calling(jump, view))
            self._views.append(handle)

    def show_actors(self, actors: tuple[Actor, ...], chosen: int | None, t_s: float) -> None:
        """Tracks and boxes anew."""
        for handle in [*self._tracks, *(each for _, nodes in self._boxes.values() for each in nodes)]:
            handle.remove()
        self._tracks, self._boxes = [], {}
        for actor in actors:
            colour, add = CHOSEN if actor.id == chosen else TRACK, self._client.scene
            places = actor.track.positions_m
            if len(places) > 1:
                vertices, faces = _ribbon(places, self._up)
                track = add.add_mesh_simple(
                    f"/tracks/{actor.id}", vertices, faces, color=colour, opacity=0.6, side="double",
                    cast_shadow=False, receive_shadow=False,
                )  # fmt: skip
                track.on_click(_calling(self._pick, actor.id))
                self._tracks.append(track)
            size_m = _size_m(actor)
            body = add.add_box(
                f"/actors/{actor.id}", colour, size_m, opacity=0.12, cast_shadow=False, receive_shadow=False
            )
            body.on_click(_calling(self._pick, actor.id))
            edges = add.add_line_segments(f"/edges/{actor.id}", _edges(size_m), colour, thickness=_LINE_M)
            self._boxes[actor.id] = (actor, [body, edges])
        self.at(t_s)
        self.show(self._shown)

    def at(self, t_s: float) -> None:
        """Boxes where their actors are at a time; those that are not there then are hidden."""
        for actor, handles in self._boxes.values():
            there = actor.track.first_s - _SLACK_S <= t_s <= actor.track.last_s + _SLACK_S
            for handle in handles:
                handle.visible = there and self._shown
                if there:
                    handle.position, handle.wxyz = _placed(actor, t_s, self._up)

    def show(self, shown: bool) -> None:
        """Show actors, or hide them."""
        self._shown = shown
        for handle in self._tracks:
            handle.visible = shown

    def show_views(self, shown: bool) -> None:
        """Show the recorded views and the drive, or hide them."""
        for handle in self._views:
            handle.visible = shown


def wxyz(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "4"]:
    """A rotation as a quaternion."""
    return Rotation.from_matrix(rotation).as_quat(scalar_first=True)


def _calling(act: Callable[[int], None], number: int) -> Callable[[Any], None]:
    return lambda _: act(number)


def _size_m(actor: Actor) -> tuple[float, float, float]:
    length_m, width_m, tall_m = (_SMALL_M,) * 3 if actor.box is None else actor.box.size_m.tolist()
    return length_m, width_m, tall_m


def _placed(
    actor: Actor, t_s: float, up: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "4"]]:
    """Middle and attitude (x ahead, y left, z up) of its box at a time."""
    track = actor.track.at(np.array([t_s]))
    ahead = _ahead(actor, float(track.yaw_rad[0]), up)
    ahead = ahead - (ahead @ up) * up
    ahead /= max(float(np.linalg.norm(ahead)), 1e-9)
    turn = np.stack([ahead, np.cross(up, ahead), up], axis=1)
    return track.positions_m[0] + 0.5 * _size_m(actor)[2] * up, wxyz(turn)


def _ahead(actor: Actor, yaw_rad: float, up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    if actor.box is not None:
        return actor.box.pointing(yaw_rad, up)
    found = actor.ahead(up)
    return np.cross(up, [1.0, 0.0, 0.0]) if found is None else found


def _ribbon(
    places: Float[np.ndarray, "t 3"], up: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Corners and triangles of a flat line along places: viser's lines cannot be clicked."""
    way = np.gradient(places, axis=0)
    aside = np.cross(way, up)
    aside *= _RIBBON_M / 2 / np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-6)
    corners = np.stack([places - aside, places + aside], axis=1).reshape(-1, 3)
    first = 2 * np.arange(len(places) - 1)[:, None]
    return corners, np.concatenate([first + np.array(each) for each in ((0, 1, 2), (2, 1, 3))])


def _edges(size_m: tuple[float, float, float]) -> Float[np.ndarray, "12 2 3"]:
    """The twelve edges of a box around the origin."""
    corners = 0.5 * np.array(size_m) * np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)]) * 2
    corners -= 0.5 * np.array(size_m)
    pairs = [(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit]
    return np.stack([corners[[a, b]] for a, b in pairs])
