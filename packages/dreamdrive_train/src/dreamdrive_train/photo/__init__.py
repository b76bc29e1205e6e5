"""Training of the network of the prior ``photo``: pairs from single pictures, the loop."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive_train.photo.loop import (
        WEIGHTS as WEIGHTS,
        PhotoTraining as PhotoTraining,
        train_photo as train_photo,
    )
    from dreamdrive_train.photo.pairs import (
        FIRST_SEED as FIRST_SEED,
        PairOptions as PairOptions,
        make_pairs as make_pairs,
        true_street as true_street,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
