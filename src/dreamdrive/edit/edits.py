"""One change of one actor each, and a scene with all of them made."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from dreamdrive.edit.behind import filled_behind
from dreamdrive.edit.insert import SetPlace, digest_of_scene, inserted
from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene
from dreamdrive.stored import load_scene

_Id = Annotated[int, Meta(ge=0, le=10**6)]
_Metres = Annotated[float, Meta(ge=-1000, le=1000)]
_Seconds = Annotated[float, Meta(ge=-3600, le=3600)]
_INDEX = "scene.json"
_Share = Annotated[float, Meta(ge=0, le=1)]


class _OfActor(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag=str.lower):
    """A change of the actor of an id."""

    actor: _Id


class Remove(_OfActor, frozen=True):
    """Without it."""

    def of(self, scene: Scene) -> Scene:
        """See ``Scene.without``."""
        return scene.without(self.actor)


class Move(_OfActor, frozen=True):
    """Elsewhere: metres ahead and to the left, as it points."""

    ahead_m: _Metres
    left_m: _Metres

    def of(self, scene: Scene) -> Scene:
        """See ``Scene.moved``."""
        return scene.moved(self.actor, self.ahead_m, self.left_m)


class Turn(_OfActor, frozen=True):
    """Turned to the left where it is."""

    degrees: Annotated[float, Meta(ge=-360, le=360)]

    def of(self, scene: Scene) -> Scene:
        """See ``Scene.turned``."""
        return scene.turned(self.actor, self.degrees)


class Delay(_OfActor, frozen=True):
    """Later, or earlier."""

    seconds: _Seconds

    def of(self, scene: Scene) -> Scene:
        """See ``Scene.delayed``."""
        return scene.delayed(self.actor, self.seconds)


class Speed(_OfActor, frozen=True):
    """So many times as fast."""

    factor: Annotated[float, Meta(ge=0.01, le=100)]

    def of(self, scene: Scene) -> Scene:
        """See ``Scene.with_speed``."""
        return scene.with_speed(self.actor, self.factor)


class Copy(_OfActor, frozen=True):
    """A second one, elsewhere as ``Move`` has it."""

    ahead_m: _Metres
    left_m: _Metres

    def of(self, scene: Scene) -> Scene:
        """See ``Scene.copied``."""
        return scene.copied(self.actor, self.ahead_m, self.left_m)


class Recolour(_OfActor, frozen=True):
    """In one colour, RGB in [0, 1]."""

    rgb: tuple[_Share, _Share, _Share]

    def of(self, scene: Scene) -> Scene:
        """See ``Scene.recoloured``."""
        return scene.recoloured(self.actor, self.rgb)


class Insert(_OfActor, frozen=True):
    """An actor of another scene, metres ahead of and to the left of the first camera.

    ``other`` is the folder of that scene, ``digest`` tells which one it was, see ``digest_of_scene``;
    ``at_s`` is when the actor is there, None where the scene begins.
    """

    other: Annotated[str, Meta(max_length=4096)]
    digest: Annotated[str, Meta(max_length=64)]
    ahead_m: _Metres
    left_m: _Metres
    at_s: _Seconds | None = None

    @classmethod
    def from_folder(
        cls, other: Path, actor: int, ahead_m: float, left_m: float, at_s: float | None = None
    ) -> "Insert":
        """Of the scene that is in a folder now, or in its ``scene``."""
        folder = other if (other / _INDEX).is_file() else other / "scene"
        return cls(actor, str(folder.resolve()), digest_of_scene(folder), ahead_m, left_m, at_s)

    def of(self, scene: Scene) -> Scene:
        """See ``inserted``; ``InputError`` where the other scene is gone, or is another one now."""
        folder = Path(self.other)
        if not (folder / _INDEX).is_file():
            raise InputError(f"insert {self.actor}: there is no scene in {folder} any more; put it back")
        if digest_of_scene(folder) != self.digest:
            raise InputError(
                f"insert {self.actor}: the scene in {folder} is another one than when this was said"
            )
        return inserted(scene, load_scene(folder), self.actor, SetPlace(self.ahead_m, self.left_m, self.at_s))


Edit = Remove | Move | Turn | Delay | Speed | Copy | Recolour | Insert


def edited(scene: Scene, edits: Iterable[Edit]) -> Scene:
    """The scene with all changes made, one after the other.

    Where an actor leaves a place, the street behind it is filled in, see ``filled_behind``.

    Raises:
        InputError: One cannot be made: there is no such actor, or it cannot be changed so.
    """
    if scene.moves_per_frame:
        raise InputError(
            "the street of this scene moves as its pictures do, as no path of the camera was found: there "
            "is no place to put an actor at"
        )
    made = scene
    for edit in edits:
        try:
            made = edit.of(made)
        except ValueError as error:
            raise InputError(f"{type(edit).__name__.lower()} {edit.actor}: {error}") from error
    return filled_behind(scene, made)
