"""Which prior an input is given to where none is named, and why."""

import os
from dataclasses import dataclass
from pathlib import Path

from dreamdrive.data.images import SUFFIXES
from dreamdrive.errors import InputError

_WITH, _ELSE = {"photo": "vista", "layout": "magicdrive"}, {"photo": "photo", "layout": "street-world"}
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
        return Choice("replay", "a recording is taken as it is")
    if kind == "photo" and with_weights:
        raise InputError(
            f"{path} is a photo: name the video model of --weights with --prior NAME, such as --prior vista"
        )
    model = _WITH[kind]
    weights = None if with_weights else os.environ.get(variable_of(model))
    if weights:
        return Choice(model, f"{variable_of(model)} tells where its weights are", weights)
    why = f"for a {kind}, as no weights of {_TITLES[model]} are configured ({variable_of(model)})"
    return Choice(_ELSE[kind], why)


def _kind_of(path: Path | None) -> str | None:
    if path is None or path.is_dir():
        return None
    if path.suffix.lower() in SUFFIXES:
        return "photo"
    return "layout" if path.suffix.lower() == ".json" else None
