"""Priors: from a control to a clip with features."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from dreamdrive.errors import InputError
from dreamdrive.prior.cosmos import COSMOS
from dreamdrive.prior.diffusers_i2v import DIFFUSERS
from dreamdrive.prior.magicdrive import MAGICDRIVE, MAGICDRIVE_T
from dreamdrive.prior.protocol import Prior
from dreamdrive.prior.replay import REPLAY, replay
from dreamdrive.prior.street_world import STREET_WORLD, street_world
from dreamdrive.prior.vista import SVD, VISTA

_ALL = (REPLAY, STREET_WORLD, SVD, VISTA, MAGICDRIVE, MAGICDRIVE_T, COSMOS, DIFFUSERS)
PRIORS: Mapping[str, Prior] = MappingProxyType({prior.name: prior for prior in _ALL})
"""Every prior by the name that ``--prior`` takes."""


def choose_prior(name: str) -> Prior:
    """The prior of that name.

    Raises:
        InputError: There is none.
    """
    if name not in PRIORS:
        raise InputError(f"--prior {name}: unknown; available are {', '.join(PRIORS)}")
    return PRIORS[name]


def prior_of(path: Path | None) -> str:
    """The prior for an input where none is named: a layout is drawn, anything else is a recording."""
    return "street-world" if path is not None and path.suffix.lower() == ".json" else "replay"


__all__ = ["PRIORS", "Prior", "choose_prior", "prior_of", "replay", "street_world"]
