"""The panel of paths: points on the road, the spline through them, its file and its video."""

from collections.abc import Callable, Coroutine
from typing import Any

import numpy as np
from jaxtyping import Float
from viser import Icon, SceneClickEvent, SceneNodeHandle, TransformControlsEvent

from dreamdrive.errors import InputError
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.show import RenderOptions
from dreamdrive.view.page.lines import wxyz
from dreamdrive.view.page.time_panel import TimePanel
from dreamdrive.view.page.tools import Tools
from dreamdrive.view.road_path import picked, spline
from dreamdrive.view.saving import CancelledError
from dreamdrive.view.session import DRIFTS, PATH, RECORDED

_COLOUR, _LINE_M, _ARROWS_M = (90, 230, 120), 0.08, 0.8
_SHOWS = ("colour", "depth", "dynamic", "static")


class PathPanel:
    """A path with the mouse, and videos of drives."""

    def __init__(self, tools: Tools, time_panel: TimePanel) -> None:
        self._tools, self._time, gui = tools, time_panel, tools.client.gui
        self._nodes: list[SceneNodeHandle] = []
        drifts = tools.session.opened.moves_per_frame
        with gui.add_folder("Path"):
            if drifts:
                gui.add_markdown(DRIFTS)
            else:
                self._build_path()
        with gui.add_folder("Save"):
            self._build_saving(drifts)

    def _build_path(self) -> None:
        gui, doing = self._tools.client.gui, self._tools.talk.doing
        self._draws = gui.add_checkbox("Click on the road", False, hint="Each click adds a point")
        self._seconds = gui.add_number("Seconds", round(self._tools.session.seconds, 1), min=0.1, step=0.5)
        self._about = gui.add_markdown("No points yet.")
        last = gui.add_button("Remove last point")
        clear = gui.add_button("Clear")
        self._draws.on_update(doing(self._listen))
        self._seconds.on_update(doing(self._timed))
        last.on_click(doing(self._less))
        clear.on_click(doing(self._clear))

    def _build_saving(self, drifts: bool) -> None:
        gui, shared, talk = self._tools.client.gui, self._tools.shared, self._tools.talk
        self._name = gui.add_text("Name", f"{shared.name}-path")
        self._show = gui.add_dropdown("Shows", _SHOWS)
        gui.add_markdown(f"The drive of the camera, as `NAME.json` or `NAME.mp4` in `{shared.desk.folder}`.")
        save = gui.add_button("Save path", icon=Icon.DEVICE_FLOPPY)
        self._render = gui.add_button("Render video", icon=Icon.MOVIE)
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._cancel = gui.add_button("Cancel", visible=False, color="red")
        save.on_click(talk.unlocked(self._save))
        self._render.on_click(talk.unlocked(self._ask_and_render))
        self._cancel.on_click(lambda _: shared.desk.cancel())

    def _listen(self) -> None:
        """Take clicks in the picture as points, or take them no more."""
        scene = self._tools.client.scene
        if self._draws.value:
            scene.on_click()(self._clicked)
        else:
            scene.remove_click_callback(self._clicked)

    def _clicked(self, event: SceneClickEvent) -> None:
        session = self._tools.session

        def add() -> None:
            place = picked(
                session.opened, np.array(event.ray_origin), np.array(event.ray_direction), session.clock.t_s
            )
            if place is None:
                raise InputError("there is nothing at that place but sky; click on the road")
            session.add_point(place)
            self.tell()

        self._tools.talk.alone(add)

    def tell(self) -> None:
        """Show points and spline anew."""
        session, scene = self._tools.session, self._tools.client.scene
        for node in self._nodes:
            node.remove()
        self._nodes = []
        for number, place in enumerate(session.points_m):
            handle = scene.add_transform_controls(
                f"/path/{number}", _ARROWS_M, active_axes=(True, True, False), disable_rotations=True,
                depth_test=False, wxyz=_level(session.opened.up), position=place,
            )  # fmt: skip
            handle.on_update(self._mover(number))
            self._nodes.append(handle)
        self._draw_line()
        if len(session.points_m) < 2 and session.drive == PATH:
            session.follow(RECORDED)
            self._time.tell()
        self._tools.refresh()

    def _draw_line(self) -> None:
        session = self._tools.session
        count = len(session.points_m)
        self._about.content = f"{count} point{'' if count == 1 else 's'}."
        try:
            road = spline(session.points_m)
        except InputError:
            return
        length_m = float(np.linalg.norm(np.diff(road, axis=0), axis=1).sum())
        speed = length_m / session.seconds * 3.6
        self._about.content = (
            f"{count} points, {length_m:.1f} m, {speed:.0f} km/h. Camera *path* drives along it."
        )
        points = np.stack([road[:-1], road[1:]], axis=1) + 0.05 * session.opened.up
        line = self._tools.client.scene.add_line_segments("/path-line", points, _COLOUR, thickness=_LINE_M)
        self._nodes.append(line)

    def _mover(self, number: int) -> Callable[[TransformControlsEvent], Coroutine[Any, Any, None]]:
        async def moved(event: TransformControlsEvent) -> None:  # in the order of the hand's moves
            def move() -> None:
                self._tools.session.points_m[number] = np.asarray(event.target.position, np.float64)
                self._draw_line()
                if event.phase == "end":
                    self.tell()

            self._tools.talk.alone(move)

        return moved

    def _timed(self) -> None:
        self._tools.session.seconds = float(self._seconds.value)
        self._draw_line()
        if self._tools.session.drive == PATH:
            self._tools.session.follow(PATH)
            self._time.tell()

    def _less(self) -> None:
        if self._tools.session.points_m:
            self._tools.session.points_m.pop()
        self.tell()

    def _clear(self) -> None:
        self._tools.session.points_m.clear()
        self.tell()

    def _driven(self) -> Trajectory:
        """What is saved and rendered: the drive of the camera, or the path where the mouse moves it."""
        session = self._tools.session
        path = session.path_of(session.drive)
        if path is not None:
            return path
        if session.points_m:
            return session.drawn()
        raise InputError("the mouse moves the camera: choose a drive under Camera, or draw a path")

    def _save(self) -> None:
        desk, name, path = self._tools.shared.desk, self._name.value, self._driven()

        def write(replace: bool) -> None:
            place = desk.save_path(path, name, replace)
            self._tools.talk.say("Saved", f"`{place}`: dreamdrive render reads it as --trajectory.")

        if desk.is_taken(name, ".json"):
            self._tools.talk.ask(
                f"`{desk.place(name, '.json')}` is there already.", "Replace it", lambda: write(True)
            )
        else:
            write(False)

    def _ask_and_render(self) -> None:
        desk, name, path = self._tools.shared.desk, self._name.value, self._driven()
        if desk.is_taken(name, ".mp4"):
            question = f"`{desk.place(name, '.mp4')}` is there already."
            self._tools.talk.ask(question, "Replace it", lambda: self._write_video(path, name, True))
        else:
            self._write_video(path, name, False)

    def _write_video(self, path: Trajectory, name: str, replace: bool) -> None:
        """On the thread of the click; it goes on where the browser goes away."""
        shared, scene = self._tools.shared, self._tools.session.scene

        def tell(done: int, total: int) -> None:
            self._bar.value = 100 * done / total

        self._bar.value, self._bar.visible, self._cancel.visible = 0.0, True, True
        try:
            options = RenderOptions(show=self._show.value)
            place = shared.desk.save_video(scene, path, name, replace, options, tell)
            self._tools.talk.say("Rendered", f"`{place}`")
        except CancelledError:
            self._tools.talk.say("Cancelled", "Nothing was written.")
        finally:
            self._bar.visible = self._cancel.visible = False


def _level(up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "4"]:
    """An attitude whose third axis points up, its first about along the drive."""
    ahead = np.array([0.0, 0.0, 1.0]) - up[2] * up
    ahead /= np.linalg.norm(ahead)
    return wxyz(np.stack([ahead, np.cross(up, ahead), up], axis=1))
