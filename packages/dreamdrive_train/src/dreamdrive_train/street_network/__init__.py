"""Training of the street network: records, batches, losses, the loop."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive_train.street_network.data.drawn import (
        CLASS_OF as CLASS_OF,
        DrawnOptions as DrawnOptions,
        draw_records as draw_records,
    )
    from dreamdrive_train.street_network.data.labelled import labelled_records as labelled_records
    from dreamdrive_train.street_network.data.loader import LoaderOptions as LoaderOptions
    from dreamdrive_train.street_network.data.records import (
        read_records as read_records,
        write_records as write_records,
    )
    from dreamdrive_train.street_network.data.textures import make_textures as make_textures
    from dreamdrive_train.street_network.loop import LOG as LOG
    from dreamdrive_train.street_network.options import TrainingOptions as TrainingOptions
    from dreamdrive_train.street_network.street import (
        WEIGHTS as WEIGHTS,
        StreetTraining as StreetTraining,
        judge_weights as judge_weights,
        train_street as train_street,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
