"""Training of the street network: records, batches, losses, the loop."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive_train.street_network.data.drawn import CLASS_OF as CLASS_OF
    from dreamdrive_train.street_network.data.loader import LoaderOptions as LoaderOptions
    from dreamdrive_train.street_network.options import TrainingOptions as TrainingOptions
    from dreamdrive_train.street_network.street import (
        WEIGHTS as WEIGHTS,
        StreetTraining as StreetTraining,
        train_street as train_street,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
