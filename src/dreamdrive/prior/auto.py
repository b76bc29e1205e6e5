"""Choice of the prior where none is named, and the reason."""

import os
from dataclasses import dataclass
from pathlib import Path

from dreamdrive.data import dataset_of
from dreamdrive.data.pictures.images import SUFFIXES
from dreamdrive.errors import InputError
from dreamdrive.prior.table import choose_prior
from dreamdrive.scene.control import Control

NAMED = "it was named"
"""Why a prior was chosen that a user named."""
DRAWS_LAYOUTS = "street-world"
"""The prior that draws a layout without any network, and knows the truth of it."""
_WITH, _ELSE = {"photo": "vista", "layout": "magicdrive"}, {"photo": "photo", "layout": DRAWS_LAYOUTS}
_TITLES = {"vista": "Vista", "magicdrive": "MagicDrive"}


@dataclass(frozen=True)
class Choice:
    """A prior by its name, why it is that one, in words, and its weights where the choice rests on them."""

    name: str
    why: str
    weights: str | None = None


def variable_of(prior: str) -> str:
    """The environment variable that tells where the weights of a prior are: a path or a name on the hub."""
    return f"DREAMDRIVE_{prior.upper()}"


def choice_of(control: Control, named: str | None = None, with_weights: bool = False) -> Choice:
    """The prior of that name, or the one for the input, see ``auto_prior``."""
    if named is not None:
        return Choice(named, NAMED)
    if control.dataset:
        return Choice("replay", "--dataset says how the recording lies on disk")
    return auto_prior(control.path, with_weights)


def taken_by(control: Control, named: str | None = None) -> tuple[str, frozenset[str]]:
    """The prior that an input goes to, and the fields of ``Control`` that it takes of such an input.

    Raises:
        InputError: There is no prior of that name, or the input is not of the data set that is named.
    """
    prior = choose_prior(choice_of(control, named).name)
    if control.path is None or not prior.recorded:
        return prior.name, prior.takes
    return prior.name, dataset_of(control.dataset, control.path).takes | {"dataset"}


def auto_prior(path: Path | None, with_weights: bool = False) -> Choice:
    """The prior for an input where none is named.

    A recording is replayed. A photo goes to Vista and a layout to MagicDrive where the environment says where
    their weights are, see ``variable_of``; else a photo is driven into and a layout is drawn.

    Args:
        path: The input.
        with_weights: Whether a network is given, for the prior or the geometry.

    Raises:
        InputError: The input is a photo and a network is given: which model it is has to be named.
    """
    kind = _kind_of(path)
    if kind is None:
        return Choice("replay", "a recording needs no video model")
    if kind == "photo" and with_weights:
        raise InputError(
            f"{path} is a photo: name the video model of --weights with --prior NAME, such as --prior vista"
        )
    model = _WITH[kind]
    weights = None if with_weights else os.environ.get(variable_of(model))
    if weights:
        return Choice(model, f"{variable_of(model)} tells where its weights are", weights)
    return Choice(_ELSE[kind], f"no weights of {_TITLES[model]} are configured ({variable_of(model)})")


def _kind_of(path: Path | None) -> str | None:
    if path is None or path.is_dir():
        return None
    if path.suffix.lower() in SUFFIXES:
        return "photo"
    return "layout" if path.suffix.lower() == ".json" else None
