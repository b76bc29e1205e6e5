"""What the page writes, by the door for output: trajectories, videos, edited scenes."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from dreamdrive.data.cameras.poses import write_trajectory
from dreamdrive.drive import Drive
from dreamdrive.edit import Edit, Edits, digest_of_scene, write_edited
from dreamdrive.errors import InputError
from dreamdrive.files.kinds import EDITED_KIND
from dreamdrive.files.output import check_free, check_new_file, check_place, check_writable
from dreamdrive.files.paths import inside
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.show import RenderOptions, write_drive

_BUSY = "a video is being rendered already; wait for it, or cancel it"


class CancelledError(Exception):
    """Somebody asked for a video to be dropped."""


@dataclass
class Desk:
    """The folder that the page writes to, and no other; and the scene that it is of."""

    folder: Path
    source: Path
    _one: threading.Lock = field(default_factory=threading.Lock, init=False)
    _stop: threading.Event = field(default_factory=threading.Event, init=False)

    def place(self, name: str, ending: str = "") -> Path:
        """Where a name leads; ``InputError`` where it leads elsewhere."""
        name = name.strip()
        if ending and not name.endswith(ending):
            name += ending
        if not name.removesuffix(ending) or "/" in name or name.startswith("."):
            raise InputError(
                f"{name!r} is no name of a file in {self.folder}; give a plain name such as mine{ending}"
            )
        return inside(self.folder, name)

    def is_taken(self, name: str, ending: str = "") -> bool:
        """Whether something is there already, which is replaced only if that is asked for."""
        return self.place(name, ending).exists()

    def save_path(self, path: Trajectory, name: str, replace: bool) -> Path:
        """Write a drive as ``render --trajectory`` reads it, and say where."""
        place = self.place(name, ".json")
        check_writable(place.parent)
        check_new_file(place, replace)
        write_trajectory(path, place)
        return place

    def save_video(
        self,
        scene: Scene,
        path: Trajectory,
        name: str,
        replace: bool,
        options: RenderOptions,
        progress: Callable[[int, int], None],
    ) -> Path:
        """Render a drive to a video, one at a time, and say where.

        Raises:
            CancelledError: It was dropped on the way; nothing is left of it.
            InputError: It cannot be written, or another one is being rendered.
        """
        place = self.place(name, ".mp4")
        check_writable(place.parent)
        check_new_file(place, replace)
        if not self._one.acquire(blocking=False):
            raise InputError(_BUSY)
        try:
            self._stop.clear()

            def tell(done: int) -> None:
                if self._stop.is_set():
                    raise CancelledError
                progress(done, len(path))

            write_drive(place, scene, Drive(place.stem, path), options, tell)
        finally:
            self._one.release()
        return place

    def cancel(self) -> None:
        """Drop the video that is being rendered, if any."""
        self._stop.set()

    def save_scene(self, opened: Scene, edits: tuple[Edit, ...], name: str, replace: bool) -> Path:
        """Write the scene with its edits as ``dreamdrive edit`` does, and say where.

        Raises:
            InputError: There are no edits, or it cannot be written.
        """
        if not edits:
            raise InputError("there is nothing to save: no actor was changed")
        place = self.place(name)
        check_place(place, self.source)
        check_free(place, replace, EDITED_KIND)
        write_edited(opened, Edits(self.digest, edits), place, replace=replace)
        return place

    @property
    def digest(self) -> str:
        """That of the scene, by which its edits know it."""
        folder = self.source if (self.source / "scene.json").is_file() else self.source / "scene"
        return digest_of_scene(folder)
