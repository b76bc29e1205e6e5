"""Networks whose features figures are made of; weights are files that the user has."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.evaluate.networks import (
        efficientnet_lite as efficientnet_lite,
        i3d as i3d,
        inception as inception,
        lpips as lpips,
        stlpips as stlpips,
        transnet as transnet,
    )
    from dreamdrive.evaluate.networks.i3d import MIN_FRAMES as MIN_FRAMES
    from dreamdrive.evaluate.networks.packaged import MissingWeightsError as MissingWeightsError

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
