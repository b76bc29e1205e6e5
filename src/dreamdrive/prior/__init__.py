"""Priors: from a control to a clip with features."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.prior import pca as pca
    from dreamdrive.prior.appearance import appearance as appearance
    from dreamdrive.prior.auto import (
        DRAWS_LAYOUTS as DRAWS_LAYOUTS,
        NAMED as NAMED,
        Choice as Choice,
        auto_prior as auto_prior,
        choice_of as choice_of,
        taken_by as taken_by,
        variable_of as variable_of,
    )
    from dreamdrive.prior.protocol import Input as Input, Prior as Prior, Seeing as Seeing
    from dreamdrive.prior.street import (
        read_street as read_street,
        wanted_frames as wanted_frames,
    )
    from dreamdrive.prior.table import PRIORS as PRIORS, choose_prior as choose_prior

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
