"""Shared parts of methods with networks: their table entry, weights from files and from the hub."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.models.backend import Backend as Backend
    from dreamdrive.models.checkpoint import (
        load_checkpoint as load_checkpoint,
        save_checkpoint as save_checkpoint,
    )
    from dreamdrive.models.efficientnet import LITE0_STAGES as LITE0_STAGES
    from dreamdrive.models.half_unet import HalfUNet as HalfUNet
    from dreamdrive.models.weights import (
        as_state as as_state,
        check_sizes as check_sizes,
        fill as fill,
        fill_network as fill_network,
        find_weights as find_weights,
        in_words as in_words,
        load_network as load_network,
        misfits as misfits,
        read_state as read_state,
        read_torch as read_torch,
        sha256 as sha256,
        some as some,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
