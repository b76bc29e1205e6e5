"""Pairs of what a network is told and of the truth: their files, and training on them."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive_train.pairs.files import (
        CROP_PX as CROP_PX,
        PlaneRange as PlaneRange,
        Source as Source,
        make_pairs as make_pairs,
    )
    from dreamdrive_train.pairs.training import (
        TRUNK as TRUNK,
        PairTask as PairTask,
        PairTraining as PairTraining,
        batch_of as batch_of,
        train_on_pairs as train_on_pairs,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
