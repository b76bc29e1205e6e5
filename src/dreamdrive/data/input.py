"""Which data set a path is of, and what it gives: the clip of a recording, or a drive with labels."""

from pathlib import Path

from dreamdrive.data.dataset import DataSet
from dreamdrive.data.table import DATASETS
from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.street.log import Log


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


def read_dataset(control: Control, log: Log | None = None) -> Clip:
    """The clip of ``control.path``, whose data set takes every field that is given.

    Where its drive is open already, as ``log``, it is not opened again.
    """
    assert control.path is not None
    chosen = dataset_of(control.dataset, control.path)
    control.check_taken(chosen.takes | {"dataset"}, f"{control.path} ({chosen.about})")
    given = {name: getattr(control, name) for name in chosen.takes}
    if log is None or chosen.logs is None or chosen.logs.clip is None:
        return chosen.read(**given)
    return chosen.logs.clip(log, **{name: given[name] for name in given if name not in ("path", "scene")})


def log_of(control: Control) -> Log | None:
    """The drive that is asked for, of a data set that has logs; else None."""
    if control.path is None:
        return None
    logs = dataset_of(control.dataset, control.path).logs
    return None if logs is None else logs.open(control.path, control.scene)
