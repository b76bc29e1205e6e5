"""What turns a path into the clip of a recording."""

from collections.abc import Callable
from dataclasses import dataclass
from inspect import signature
from pathlib import Path

from dreamdrive.choices import DATASETS
from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.log import Log

_SHOWN = 10
"""Names of scenes that a message lists."""


@dataclass(frozen=True)
class Logs:
    """Drives of a data set, with what is labelled, measured and mapped.

    Attributes:
        names: Of the drives at a path.
        read: A drive by its name.
    """

    names: Callable[[Path], tuple[str, ...]]
    read: Callable[[Path, str], Log]

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


def dataset_of(name: str | None, path: Path) -> DataSet:
    """The data set of that name, or the first of dreamdrive's own that recognises the path.

    Outside packages are asked by name only: what is installed beside it never changes what a command does.
    """
    if name is None:
        return next(each for each in map(DATASETS.choose, DATASETS.own) if each.recognises(path))
    chosen = DATASETS.choose(name)
    if not chosen.recognises(path):
        raise InputError(f"--dataset {name}: {path} is not one of it; expected {chosen.about}")
    return chosen


def read_dataset(control: Control) -> Clip:
    """The clip of ``control.path``, whose data set takes every field that is given."""
    assert control.path is not None
    chosen = dataset_of(control.dataset, control.path)
    control.check_taken(chosen.takes | {"dataset"}, f"{control.path} ({chosen.about})")
    return chosen.read(**{name: getattr(control, name) for name in chosen.takes})


def log_of(control: Control) -> Log | None:
    """The drive that is asked for, of a data set that has logs; else None."""
    if control.path is None:
        return None
    logs = dataset_of(control.dataset, control.path).logs
    return None if logs is None else logs.open(control.path, control.scene)


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
