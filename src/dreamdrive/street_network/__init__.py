"""The small street network: what a picture shows, without any geometry."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.street_network.blur import blur as blur
    from dreamdrive.street_network.files import write_look as write_look
    from dreamdrive.street_network.look import LookOptions as LookOptions, Network as Network, look as look
    from dreamdrive.street_network.network import StreetNetwork as StreetNetwork
    from dreamdrive.street_network.of_clip import look_at as look_at, with_looks as with_looks
    from dreamdrive.street_network.prediction import Prediction as Prediction
    from dreamdrive.street_network.shipped import (
        NO_KNOWLEDGE as NO_KNOWLEDGE,
        SHIPPED as SHIPPED,
        load_knowledge as load_knowledge,
        weights_of as weights_of,
    )
    from dreamdrive.street_network.upright import (
        HALF_TURN as HALF_TURN,
        turns_to_upright as turns_to_upright,
        upright as upright,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
