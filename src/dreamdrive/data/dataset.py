"""What turns a path into the clip of a recording."""

from collections.abc import Callable
from dataclasses import dataclass
from inspect import signature
from pathlib import Path

from dreamdrive.choices import DATASETS
from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control


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
    """

    name: str
    about: str
    recognises: Callable[[Path], bool]
    read: Callable[..., Clip]
    deep: bool = True

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
