"""Restorer: a small network that mends views from aside with what the recorded frames show there."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.restore.carried import Recordings as Recordings
    from dreamdrive.restore.network import (
        CHANNELS as CHANNELS,
        ERROR as ERROR,
        FIRST_PLANES as FIRST_PLANES,
        MOVES as MOVES,
        UNSEEN as UNSEEN,
        RestorerNetwork as RestorerNetwork,
        load_restorer as load_restorer,
    )
    from dreamdrive.restore.restorer import Restorer as Restorer

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
