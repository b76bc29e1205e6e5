"""Data sets as readers: from a path to the clip of a recording."""

from collections.abc import Callable
from dataclasses import dataclass
from inspect import signature
from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.street.log import Log

_SHOWN = 10
"""Names of scenes that a message lists."""


@dataclass(frozen=True)
class Logs:
    """Drives of a data set, with what is labelled, measured and mapped.

    Attributes:
        names: Of the drives at a path.
        read: A drive by its name.
        clip: From a drive that is open and the keywords of ``DataSet.read``, but for path and scene, to its
            clip; None where the data set opens it again for that.
    """

    names: Callable[[Path], tuple[str, ...]]
    read: Callable[[Path, str], Log]
    clip: Callable[..., Clip] | None = None

    def open(self, path: Path, scene: str | None) -> Log:
        """A drive by its name or number, see ``choose_scene``."""
        return self.read(path, choose_scene(self.names(path), scene, path))


@dataclass(frozen=True, kw_only=True)
class DataSet:
    """Recordings that lie on disk in one way, by its name for ``--dataset``.

    Attributes:
        name: For the command line.
        about: What lies at its paths, for people: "expected ...".
        recognises: Whether a path is one of it; looks at names, not at contents.
        read: From a path to its clip; what the data set knows of poses, cameras and depth is ``Clip.known``.
            Its keywords are the fields of ``Control`` that it honours. Raises ``InputError`` where the path
            cannot be read.
        deep: Whether folders inside a folder belong to the recording: what they hold decides over the result.
        logs: Its drives; None where a path is a single recording without labels.
    """

    name: str
    about: str
    recognises: Callable[[Path], bool]
    read: Callable[..., Clip]
    deep: bool = True
    logs: Logs | None = None

    @property
    def takes(self) -> frozenset[str]:
        """Names of the fields of ``Control`` that it honours."""
        return frozenset(signature(self.read).parameters)


def choose_scene(names: tuple[str, ...], given: str | None, path: Path) -> str:
    """The name of a drive by its name, or by its number counted from 0; the only one needs no choice."""
    some = ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
    if given is None and len(names) == 1:
        return names[0]
    if given in names:
        return given
    if given is not None and given.isdecimal() and int(given) < len(names):
        return names[int(given)]
    got = "no --scene is given" if given is None else f"--scene {given} is none of them"
    raise InputError(
        f"{path} holds {len(names)} scenes, {some}, and {got}; expected a name, or a number from 0 to "
        f"{len(names) - 1}: dreamdrive data list {path} tells all"
    )
