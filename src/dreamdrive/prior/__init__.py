"""Priors: from a control to a clip with features."""

from pathlib import Path

from dreamdrive.choices import PRIORS
from dreamdrive.data.images import SUFFIXES
from dreamdrive.errors import InputError
from dreamdrive.prior.protocol import Prior
from dreamdrive.prior.street_world import FRAMES, SIZE

choose_prior = PRIORS.choose


def prior_of(path: Path | None, with_weights: bool = False) -> str:
    """The prior for an input where none is named: a layout is drawn, a photo driven into, all else replayed.

    Args:
        path: The input.
        with_weights: Whether a network is given, for the prior or the geometry.

    Raises:
        InputError: The input is a photo and a network is given: which model it is has to be named.
    """
    if path is not None and path.is_file() and path.suffix.lower() in SUFFIXES:
        if with_weights:
            raise InputError(
                f"{path} is a photo: name the video model of --weights with --prior NAME, such as "
                "--prior vista"
            )
        return "photo"
    return "street-world" if path is not None and path.suffix.lower() == ".json" else "replay"
