"""The panel of actors: pick one, change it, take it back, save the scene."""

from collections.abc import Callable

import numpy as np
from viser import Icon, TransformControlsEvent, TransformControlsHandle

from dreamdrive.edit import Copy, Delay, Edit, Recolour, Remove, Speed, Turn
from dreamdrive.errors import InputError
from dreamdrive.view.page.lines import wxyz
from dreamdrive.view.page.tools import Tools

NONE = "none"
_KM_H = 3.6
_FILLED = "Streets behind actors that were moved are filled when the scene is saved."


class ActorPanel:
    """Actors with the mouse; without any it says why."""

    def __init__(self, tools: Tools) -> None:
        self._tools, gui = tools, tools.client.gui
        self._handle: TransformControlsHandle | None = None
        why = tools.session.why_no_actors
        with gui.add_folder("Actors"):
            if why is not None:
                gui.add_markdown(why)
                return
            self._pick = gui.add_dropdown("Actor", self._names(), initial_value=NONE)
            self._about = gui.add_markdown("Click a box or a track in the picture.")
            self._chosen = gui.add_folder(None, visible=False)
            with self._chosen:
                self._build_edits()
            self._undo = gui.add_button("Undo", icon=Icon.ARROW_BACK_UP, disabled=True)
            self._name = gui.add_text("Name", f"{tools.shared.name}-edited")
            self._save = gui.add_button(
                "Save as", icon=Icon.DEVICE_FLOPPY, hint=f"In {tools.shared.desk.folder}"
            )
            gui.add_markdown(f"In `{tools.shared.desk.folder}`. {_FILLED}")
        doing = tools.talk.doing
        self._pick.on_update(doing(self._picked))
        self._undo.on_click(doing(self._take_back))
        self._save.on_click(tools.talk.unlocked(self._ask_and_save))

    def _build_edits(self) -> None:
        gui = self._tools.client.gui
        turn = gui.add_number("Turn left, degrees", 15.0, step=5.0, min=-360, max=360)
        self._button("Turn", lambda id: Turn(id, float(turn.value)))
        delay = gui.add_number("Later, seconds", 0.5, step=0.1)
        self._button("Delay", lambda id: Delay(id, float(delay.value)))
        speed = gui.add_number("Times as fast", 1.5, step=0.1, min=0.01, max=100)
        self._button("Change speed", lambda id: Speed(id, float(speed.value)))
        colour = gui.add_rgb("Colour", (192, 32, 32))
        self._button(
            "Paint",
            lambda id: Recolour(id, (colour.value[0] / 255, colour.value[1] / 255, colour.value[2] / 255)),
        )
        left = gui.add_number("Copy to the left, m", 3.0, step=0.5)
        self._button("Copy", lambda id: Copy(id, 0.0, float(left.value)))
        self._button("Remove", Remove, color="red")

    def _button(self, label: str, edit: Callable[[int], Edit], color: str | None = None) -> None:
        def change() -> None:
            if self._tools.session.chosen is not None:
                self.change(edit(self._tools.session.chosen))

        button = self._tools.client.gui.add_button(label, color="red" if color else None)
        button.on_click(self._tools.talk.doing(change))

    def choose(self, id: int | None) -> None:
        """Pick an actor, or none."""
        self._tools.session.pick(id)
        self.tell()

    def change(self, edit: Edit) -> None:
        """Make an edit and show what it makes."""
        self._tools.session.edit(edit)
        self.tell()

    def tell(self) -> None:
        """Show what the session is at."""
        session = self._tools.session
        self._pick.options = self._names()
        self._pick.value = NONE if session.chosen is None else self._name_of(session.chosen)
        self._undo.disabled = not session.edits
        self._chosen.visible = session.chosen is not None
        self._about.content = self._told()
        self._tools.show_actors()
        self._put_handle()

    def _told(self) -> str:
        session = self._tools.session
        changes = f"Changes made here: {len(session.edits)}." if session.edits else ""
        if session.chosen is None:
            return f"Click a box or a track in the picture. {changes}"
        actor = session.scene.actor(session.chosen)
        speed = float(actor.track.speed_m_s.mean()) * _KM_H
        return f"{actor.kind}, {speed:.0f} km/h. Drag it by its arrows. {changes}"

    def _names(self) -> tuple[str, ...]:
        return (NONE, *(self._name_of(actor.id) for actor in self._tools.session.actors))

    def _name_of(self, id: int) -> str:
        return f"{id}: {self._tools.session.scene.actor(id).kind}"

    def _picked(self) -> None:
        name = self._pick.value
        self.choose(None if name == NONE else int(name.partition(":")[0]))

    def _take_back(self) -> None:
        self._tools.session.undo()
        self.tell()

    def _put_handle(self) -> None:
        """Arrows at the picked actor, along and across the way it points."""
        if self._handle is not None:
            self._handle.remove()
            self._handle = None
        session, scene = self._tools.session, self._tools.session.scene
        if session.chosen is None:
            return
        actor = scene.actor(session.chosen)
        ahead = actor.ahead(scene.up)
        if ahead is None:
            return
        t_s = float(np.clip(session.clock.t_s, actor.track.first_s, actor.track.last_s))
        start = actor.track.at(np.array([t_s])).positions_m[0]
        left = np.cross(scene.up, ahead)
        turn = np.stack([ahead, left, np.cross(ahead, left)], axis=1)
        self._handle = self._tools.client.scene.add_transform_controls(
            "/arrows", 2.0, active_axes=(True, True, False), disable_rotations=True, depth_test=False,
            wxyz=wxyz(turn), position=start,
        )  # fmt: skip

        async def dragged(event: TransformControlsEvent) -> None:  # in the order of the hand's moves
            self._drag(np.asarray(event.target.position) - start, event.phase == "end")

        self._handle.on_update(dragged)

    def _drag(self, by_m: np.ndarray, done: bool) -> None:
        def drag() -> None:
            self._tools.session.drag(by_m, done)
            if done:
                self.tell()
            self._tools.refresh()

        self._tools.talk.alone(drag)

    def _ask_and_save(self) -> None:
        desk, name = self._tools.shared.desk, self._name.value
        if desk.is_taken(name):
            question = f"`{desk.place(name)}` is there already."
            self._tools.talk.ask(question, "Replace it", lambda: self._write(name, True))
        else:
            self._write(name, False)

    def _write(self, name: str, replace: bool) -> None:
        shared, session = self._tools.shared, self._tools.session
        if not session.edits:
            raise InputError("there is nothing to save: no actor was changed")
        note = self._tools.client.add_notification(
            "Saving", "The street is filled where actors were.", loading=True
        )
        try:
            place = shared.desk.save_scene(session.opened, session.edits, name, replace)
        finally:
            note.remove()
        self._tools.talk.say("Saved", f"`{place}`: open it with dreamdrive view, render, edit.")
