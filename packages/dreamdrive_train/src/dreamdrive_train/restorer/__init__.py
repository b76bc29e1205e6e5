"""Training of the restorer: pairs of renders and of what is truly to be seen, what is learned of them."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive_train.restorer.learn import RESTORER as RESTORER
    from dreamdrive_train.restorer.pairs import (
        FIRST_SEED as FIRST_SEED,
        RestorerPairs as RestorerPairs,
        restorer_pairs as restorer_pairs,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
