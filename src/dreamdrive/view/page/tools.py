"""What the panels of one browser work with."""

from collections.abc import Callable
from dataclasses import dataclass

from viser import ClientHandle

from dreamdrive.scene.scene import Scene
from dreamdrive.view.frames import FrameLoop
from dreamdrive.view.layers import Kept
from dreamdrive.view.page.lines import Lines
from dreamdrive.view.page.talk import Talk
from dreamdrive.view.saving import Desk
from dreamdrive.view.session import Session


@dataclass(frozen=True)
class Shared:
    """What all browsers share: the scene, what its run keeps, where to write, who draws."""

    scene: Scene
    kept: Kept
    desk: Desk
    frames: FrameLoop
    name: str


@dataclass(frozen=True)
class Tools:
    """What the panels of one browser share; ``refresh`` asks for a new picture."""

    client: ClientHandle
    shared: Shared
    session: Session
    talk: Talk
    lines: Lines
    refresh: Callable[[], None]

    def show_actors(self) -> None:
        """Boxes and tracks anew, as an actor was picked or changed."""
        self.lines.show_actors(self.session.actors, self.session.chosen, self.session.clock.t_s)
        self.refresh()
