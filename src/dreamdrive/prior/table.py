"""Priors by their names."""

from typing import TYPE_CHECKING

from dreamdrive.registry import Table

if TYPE_CHECKING:
    from dreamdrive.prior.protocol import Prior

PRIORS: "Table[Prior]" = Table(
    "--prior",
    "dreamdrive.priors",
    "dreamdrive.prior:Prior",
    {
        "replay": "dreamdrive.prior.replay:REPLAY",
        "street-world": "streetworld.prior:STREET_WORLD",
        "photo": "dreamdrive.prior.photo:PHOTO",
        "svd": "dreamdrive.prior.vista:SVD",
        "vista": "dreamdrive.prior.vista:VISTA",
        "magicdrive": "dreamdrive.prior.magicdrive:MAGICDRIVE",
        "magicdrive-t": "dreamdrive.prior.magicdrive:MAGICDRIVE_T",
        "cosmos": "dreamdrive.prior.cosmos:COSMOS",
        "diffusers": "dreamdrive.prior.diffusers_i2v:DIFFUSERS",
    },
)
"""From a control to a clip."""

choose_prior = PRIORS.choose
"""By its name, see ``Table.choose``."""
