"""Training of the network of the prior ``photo``: pairs from single pictures, what is learned of them."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive_train.photo.learn import PHOTO as PHOTO
    from dreamdrive_train.photo.pairs import (
        FIRST_SEED as FIRST_SEED,
        PairOptions as PairOptions,
        photo_pairs as photo_pairs,
        true_street as true_street,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
