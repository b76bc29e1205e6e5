"""One change of one actor each, and a scene with all of them made."""

from collections.abc import Iterable
from typing import Annotated

import msgspec
from msgspec import Meta

from dreamdrive.edit.behind import filled_behind
from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene

_Id = Annotated[int, Meta(ge=0, le=10**6)]
_Metres = Annotated[float, Meta(ge=-1000, le=1000)]
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

    seconds: Annotated[float, Meta(ge=-3600, le=3600)]

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


Edit = Remove | Move | Turn | Delay | Speed | Copy | Recolour


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
    made, leaves = scene, False
    for edit in edits:
        leaves |= not isinstance(edit, Copy | Recolour)
        try:
            made = edit.of(made)
        except ValueError as error:
            raise InputError(f"{type(edit).__name__.lower()} {edit.actor}: {error}") from error
    return filled_behind(scene, made) if leaves else made
