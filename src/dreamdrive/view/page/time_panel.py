"""The panel of what is shown when: time, drive, layer, the recorded frame, lines."""

import numpy as np
from viser import Icon

from dreamdrive.show import Image
from dreamdrive.view.clock import SPEEDS
from dreamdrive.view.layers import layers_of
from dreamdrive.view.page.tools import Tools
from dreamdrive.view.recorded import nearest_view
from dreamdrive.view.session import DRIFTS, DRIVES, FREE, PATH

BESIDE: str = "beside"
OVER: str = "over"
"""Where the recorded frame is shown."""
_AWAY: str = "away"
_STEP_S = 0.01


class TimePanel:
    """Time and what is shown; a user's hand changes the session, and what happens there is told here."""

    def __init__(self, tools: Tools, has_frames: bool) -> None:
        self._tools, gui, clock = tools, tools.client.gui, tools.session.clock
        self.beside, self._told = "", False
        span_s = max(clock.last_s - clock.first_s, _STEP_S)
        with gui.add_folder("Time"):
            self._slider = gui.add_slider("Seconds", 0.0, round(span_s, 2), _STEP_S, 0.0)
            self._play = gui.add_button("Play", icon=Icon.PLAYER_PLAY)
            self._speed = gui.add_dropdown("Speed", SPEEDS, initial_value="1")
            self._drive = gui.add_dropdown("Camera", self._drives(), initial_value=tools.session.drive)
        with gui.add_folder("Shown"):
            layers = layers_of(tools.shared.scene, tools.shared.kept)
            self._layer = gui.add_dropdown("Layer", layers, initial_value=tools.session.layer)
            self._lines = gui.add_checkbox("Actors", True, visible=bool(tools.session.actors))
            self._views = gui.add_checkbox(
                "Recorded views", False, hint="Of a free camera; click one to go there"
            )
            places: tuple[str, ...] = (_AWAY, BESIDE, OVER)
            self._where = gui.add_dropdown("Recorded frame", places, initial_value=_AWAY, visible=has_frames)
            blank = np.zeros((2, 2, 3), np.uint8)
            self._frame = gui.add_image(blank, format="jpeg", visible=False)
            if tools.session.opened.moves_per_frame:
                gui.add_markdown(DRIFTS)
        doing = tools.talk.doing
        self._slider.on_update(doing(self._to))
        self._play.on_click(doing(self._start_or_stop))
        self._speed.on_update(doing(self._at_speed))
        self._drive.on_update(doing(self._follow))
        self._layer.on_update(doing(self._show))
        self._lines.on_update(doing(self._with_lines))
        self._views.on_update(doing(tools.refresh))
        self._where.on_update(doing(self._put_frame))

    def _drives(self) -> tuple[str, ...]:
        drifts = self._tools.session.opened.moves_per_frame
        return tuple(name for name in DRIVES if not (drifts and name == PATH))

    def at(self, t_s: float, frame: tuple[int, Image] | None) -> None:
        """Show a time, and a recorded frame in place of the one before."""
        self._slider.value = round(t_s - self._tools.session.clock.first_s, 2)
        if frame is not None:
            view, self._frame.image = frame
            scene = self._tools.shared.scene
            self._frame.label = (
                f"View {nearest_view(scene, scene.times_s[view])}, {scene.times_s[view]:.2f} s"
            )

    def tell(self) -> None:
        """Show what the session is at, as something else has changed it."""
        session, clock = self._tools.session, self._tools.session.clock
        self._slider.max = round(max(clock.last_s - clock.first_s, _STEP_S), 2)
        self._drive.value = session.drive
        self._layer.value = session.layer
        self._where.value = self.beside or _AWAY
        self._frame.visible = self.beside == BESIDE
        self._play.label, self._play.icon = (
            ("Pause", Icon.PLAYER_PAUSE) if clock.playing else ("Play", Icon.PLAYER_PLAY)
        )

    def _to(self) -> None:
        clock = self._tools.session.clock
        clock.pause()
        clock.set(clock.first_s + self._slider.value)
        self.tell()
        self._tools.refresh()

    def _start_or_stop(self) -> None:
        clock = self._tools.session.clock
        if clock.playing:
            clock.pause()
        else:
            clock.play()
        self.tell()
        self._tools.refresh()

    def _at_speed(self) -> None:
        clock = self._tools.session.clock
        clock.tick()
        clock.speed = float(self._speed.value)

    def _follow(self) -> None:
        session = self._tools.session
        try:
            session.follow(self._drive.value)
        finally:
            self.tell()
        self._tools.refresh()

    def _show(self) -> None:
        self._tools.session.layer = self._layer.value
        self._tools.refresh()

    def _with_lines(self) -> None:
        self._tools.lines.show(self._lines.value)
        self._tools.refresh()

    def _put_frame(self) -> None:
        self.beside = "" if self._where.value == _AWAY else self._where.value
        self._frame.visible = self.beside == BESIDE
        self._tools.refresh()

    @property
    def shows_views(self) -> bool:
        """Whether the recorded views are shown: they are in the way of who looks out of one of them."""
        return self._views.value and self._tools.session.drive == FREE
