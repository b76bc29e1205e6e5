"""Edits on disk, beside the scene that they made; they know the scene that they are of."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from dreamdrive.edit.edits import Edit, edited
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type, read_json, write_json
from dreamdrive.files.kinds import EDITED_KIND
from dreamdrive.files.output import new_folder
from dreamdrive.scene.scene import Scene
from dreamdrive.stored import save_scene

EDITS = "edits.json"
"""In the folder of an edited scene."""
FORMAT = "dreamdrive edits"


@dataclass(frozen=True)
class Edits:
    """Changes in their order.

    Attributes:
        of: Digest of the scene that they are of, see ``digest_of_scene``.
        edits: The changes.
    """

    of: str
    edits: tuple[Edit, ...]

    def and_then(self, more: tuple[Edit, ...]) -> "Edits":
        """With others after them."""
        return Edits(self.of, self.edits + more)

    def less(self, last: int) -> "Edits":
        """Without so many of the last ones; ``InputError`` where there are fewer."""
        if not 0 <= last <= len(self.edits):
            raise InputError(f"--undo {last}: there are {len(self.edits)} edits")
        return Edits(self.of, self.edits[: len(self.edits) - last])


class _Stored(msgspec.Struct, frozen=True):
    format: str
    version: int
    of: str
    edits: list[Edit]


def read_edits(file: Path) -> Edits:
    """The edits in a file; ``InputError`` where it holds none."""
    values = read_json(file)
    if values.get("format") != FORMAT or values.get("version") != 1:
        raise InputError(f"{file} holds no edits; expected one that dreamdrive edit wrote, {EDITS}")
    stored = of_type(values, _Stored, str(file))
    return Edits(stored.of, tuple(stored.edits))


def write_edited(scene: Scene, edits: Edits, folder: Path, *, replace: bool = False) -> Scene:
    """Make edits of a scene, and write a folder that all commands take a scene from; the edits lie in it.

    Raises:
        InputError: An edit cannot be made, or the folder cannot be written.
    """
    made = edited(scene, edits.edits)
    with new_folder(folder, replace=replace, kind=EDITED_KIND) as fresh:
        save_scene(made, fresh / "scene")
        write_json(fresh / EDITS, _told(edits))
    return made


def _told(edits: Edits) -> dict[str, Any]:
    each: list[Any] = [msgspec.to_builtins(edit) for edit in edits.edits]
    return {"format": FORMAT, "version": 1, "of": edits.of, "edits": each}
