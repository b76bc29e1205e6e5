"""An open page: the server, the thread that draws, and who looks."""

import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from viser import ClientHandle

from dreamdrive.run import stages_of
from dreamdrive.scene.scene import Scene
from dreamdrive.view.during import RunWatch, WaitingPage
from dreamdrive.view.frames import FrameLoop
from dreamdrive.view.layers import Kept
from dreamdrive.view.page.page import Page
from dreamdrive.view.page.tools import Shared
from dreamdrive.view.saving import Desk
from dreamdrive.view.server import PageServer, serve


class OpenPage(Protocol):
    """What one browser shows."""

    def close(self) -> None:
        """It is shown no more."""
        ...


Make = Callable[[ClientHandle], OpenPage]
"""Builds the page of a browser."""


@dataclass
class Viewer:
    """A server with a page for each browser; what pages show can become another thing.

    Attributes:
        server: viser's server, behind its gate.
        address: What to open in a browser.
        frames: The thread that draws.
        make: What builds the page of each browser.
    """

    server: PageServer
    address: str
    frames: FrameLoop
    make: Make
    desk: Desk
    _pages: dict[int, OpenPage] = field(default_factory=dict[int, OpenPage], init=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False)

    def open(self) -> None:
        """Begin to draw, and to answer browsers."""
        self.frames.start()
        self.server.on_client_connect(self._came)
        self.server.on_client_disconnect(self._went)

    def become(self, make: Make) -> None:
        """Build the pages of all browsers anew, as something else."""
        with self._lock:
            self.make = make
        for client in self.server.get_clients().values():
            self._went(client)
            client.scene.reset()
            client.gui.reset()
            self._came(client)

    def close(self) -> None:
        """End it; a video that is being rendered is dropped."""
        self.desk.cancel()
        self.server.stop()
        self.frames.close()

    def _came(self, client: ClientHandle) -> None:
        page = self.make(client)
        with self._lock:
            self._pages[client.client_id] = page

    def _went(self, client: ClientHandle) -> None:
        with self._lock:
            page = self._pages.pop(client.client_id, None)
        if page is not None:
            page.close()


def _pages_of(scene: Scene, out: Path, desk: Desk, frames: FrameLoop) -> Make:
    shared = Shared(scene, Kept(stages_of(out)), desk, frames, out.resolve().name)
    return lambda client: Page(client, shared)


def view_scene(scene: Scene, out: Path, host: str, listening: socket.socket, desk: Desk) -> Viewer:
    """Open the page of a scene; it is served until it is closed."""
    frames, (server, address) = FrameLoop(), serve(host, listening)
    viewer = Viewer(server, address, frames, _pages_of(scene, out, desk, frames), desk)
    viewer.open()
    return viewer


def view_run(out: Path, host: str, listening: socket.socket, desk: Desk) -> tuple[Viewer, RunWatch]:
    """Open the page of a run that may be at work: what it has, until the scene is there.

    The watch tells the page; its ``look`` is to be called now and then.
    """
    frames, (server, address) = FrameLoop(), serve(host, listening)
    viewer = Viewer(server, address, frames, lambda client: WaitingPage(client, ""), desk)

    def show(scene: Scene) -> None:
        viewer.become(_pages_of(scene, out, desk, frames))

    def wait(said: str, picture: Path | None) -> None:
        viewer.become(lambda client: WaitingPage(client, said, picture))

    watch = RunWatch(out, show, wait)
    viewer.open()
    return viewer, watch
