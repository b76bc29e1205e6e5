"""A run that is still at work: what it has, stage by stage, until its scene is there."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from viser import ClientHandle

from dreamdrive.errors import InputError
from dreamdrive.files.paths import inside, read_bytes
from dreamdrive.run import FIRST_PICTURE, REPORT, STAGES, is_kept, kept_static, stages_of
from dreamdrive.scene.scene import Scene
from dreamdrive.stored import load_scene

_MOST_BYTES = 50_000_000
_NOT_YET = "nothing yet"


@dataclass(frozen=True)
class RunState:
    """What a run has: the last stage that ended, whether its first picture is there, whether its scene is."""

    last: str | None
    pictured: bool
    finished: bool

    @property
    def said(self) -> str:
        """The same in words."""
        if self.finished:
            return "The scene is there."
        if self.last is None:
            return "Nothing has ended yet: the frames are being read or drawn."
        after = STAGES.index(self.last) + 1
        now = f"{STAGES[after]} is at work" if after < len(STAGES) else "videos and the report are being made"
        return f"{self.last} has ended, {now} (stage {min(after + 1, len(STAGES))} of {len(STAGES)})."


def state_of(out: Path) -> RunState:
    """What the run in a folder has; nothing where there is none yet."""
    stages = stages_of(out)
    ended = [name for name in STAGES if stages.is_dir() and is_kept(stages, name)]
    finished = (out / REPORT).is_file() and (out / "scene" / "scene.json").is_file()
    return RunState(ended[-1] if ended else None, (stages / FIRST_PICTURE).is_file(), finished)


@dataclass
class RunWatch:
    """Looks at a folder now and then, and says where there is something new to show.

    Attributes:
        out: The folder.
        show: Called with a scene: the static fit, then the scene itself.
        wait: Called with a sentence and a picture while there is no scene.
    """

    out: Path
    show: Callable[[Scene], None]
    wait: Callable[[str, Path | None], None]
    _seen: RunState | None = field(default=None, init=False)
    _drawn: str | None = field(default=None, init=False)

    def look(self) -> bool:
        """Look once; whether the scene is there, so that nothing more will come."""
        state = state_of(self.out)
        if state == self._seen:
            return state.finished
        try:
            self._tell(state)
        except InputError:
            return False  # a stage is being written at this moment; the next look finds it whole
        self._seen = state
        return state.finished

    def _tell(self, state: RunState) -> None:
        stages = stages_of(self.out)
        if state.finished:
            self.show(load_scene(inside(self.out, "scene")))
        elif state.last is not None and is_kept(stages, "fit"):
            self._once("fit", lambda: load_scene(inside(inside(stages, "fit"), "value")))
        elif state.last is not None and is_kept(stages, "static"):
            self._once("static", lambda: kept_static(stages))
        else:
            self.wait(state.said, inside(stages, FIRST_PICTURE) if state.pictured else None)

    def _once(self, what: str, scene: Callable[[], Scene]) -> None:
        """Stages after the static fit that change no picture leave the page as it is."""
        if self._drawn != what:
            self.show(scene())
            self._drawn = what


class WaitingPage:
    """What a browser shows before there is a scene."""

    def __init__(self, client: ClientHandle, said: str, picture: Path | None = None) -> None:
        client.gui.add_markdown(f"**A scene is being made.** {said or _NOT_YET}")
        found = None if picture is None else _read(picture)
        client.scene.set_background_image(found)

    def close(self) -> None:
        """Nothing goes on."""


def _read(picture: Path) -> np.ndarray | None:
    try:
        data = np.frombuffer(read_bytes(picture, at_most=_MOST_BYTES, follow=False), np.uint8)
    except InputError:
        return None
    image = cv2.imdecode(data, cv2.IMREAD_COLOR)
    return None if image is None else cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
