"""Scenes below a folder, by what their files say, without reading any of them whole."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json

_DEEPEST, _MOST_FOLDERS = 5, 20_000


@dataclass(frozen=True)
class SceneOnDisk:
    """A scene on disk.

    Attributes:
        path: What to give to a command.
        frames: Number of its views.
        bytes: Of its files.
        actors: Number of them.
        changed: When it was written.
    """

    path: Path
    frames: int
    bytes: int
    actors: int
    changed: datetime


def scenes_below(folder: Path) -> list[SceneOnDisk]:
    """All scenes a few folders deep, by name; links and hidden folders are not followed."""
    found: dict[Path, SceneOnDisk] = {}
    for index in _indices(folder):
        scene = index.parent
        path = scene.parent if scene.name == "scene" and scene != folder else scene
        try:
            values = read_json(index, follow=False)
            frames, actors = len(values["cameras"]), len(values["actors"])
        except (InputError, KeyError, TypeError):
            continue
        size = sum(each.stat().st_size for each in scene.iterdir() if each.is_file())
        found[path] = SceneOnDisk(path, frames, size, actors, datetime.fromtimestamp(index.stat().st_mtime))
    return [found[path] for path in sorted(found)]


def _indices(folder: Path) -> Iterator[Path]:
    for count, (place, folders, files) in enumerate(os.walk(folder)):
        if count >= _MOST_FOLDERS:
            return
        deep = len(Path(place).relative_to(folder).parts)
        # Below stages lie parts of the same scenes.
        folders[:] = (
            sorted(f for f in folders if not f.startswith(".") and f != "stages") if deep < _DEEPEST else []
        )
        if "scene.json" in files:
            yield Path(place) / "scene.json"
