"""Priors: from a control to a clip with features."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from dreamdrive.data.images import SUFFIXES
from dreamdrive.errors import InputError
from dreamdrive.prior.cosmos import COSMOS
from dreamdrive.prior.diffusers_i2v import DIFFUSERS
from dreamdrive.prior.magicdrive import MAGICDRIVE, MAGICDRIVE_T
from dreamdrive.prior.protocol import Prior
from dreamdrive.prior.replay import REPLAY, replay
from dreamdrive.prior.street_world import FRAMES, SIZE, STREET_WORLD, street_world
from dreamdrive.prior.vista import SVD, VISTA
from dreamdrive.progress import Progress, silent

_ALL = (REPLAY, STREET_WORLD, SVD, VISTA, MAGICDRIVE, MAGICDRIVE_T, COSMOS, DIFFUSERS)
PRIORS: Mapping[str, Prior] = MappingProxyType({prior.name: prior for prior in _ALL})
"""Every prior by the name that ``--prior`` takes."""
OF_PHOTOS = tuple(prior.name for prior in (VISTA, SVD, COSMOS, DIFFUSERS))
"""Those that go on from a photo."""


def choose_prior(name: str) -> Prior:
    """The prior of that name.

    Raises:
        InputError: There is none.
    """
    if name not in PRIORS:
        raise InputError(f"--prior {name}: unknown; available are {', '.join(PRIORS)}")
    return PRIORS[name]


def prior_of(path: Path | None, with_weights: bool = False) -> str:
    """The prior for an input where none is named: a layout is drawn, anything else is a recording.

    Args:
        path: The input.
        with_weights: Whether a network is given, for the prior or the geometry.

    Raises:
        InputError: The input is a photo and a network is given: which model it is has to be named.
    """
    if with_weights and path is not None and path.is_file() and path.suffix.lower() in SUFFIXES:
        raise InputError(
            f"{path} is a photo: name the video model of --weights with --prior {'|'.join(OF_PHOTOS)}"
        )
    return "street-world" if path is not None and path.suffix.lower() == ".json" else "replay"
