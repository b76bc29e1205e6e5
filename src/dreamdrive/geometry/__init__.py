"""F_MVS (eq. 4): from a clip to cameras, depth, confidence, sky and evidence of motion."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.geometry.backends.files import (
        EXPECTED as EXPECTED,
        attach as attach,
        bent_model as bent_model,
        companions as companions,
    )
    from dreamdrive.geometry.cameras import Posed as Posed, calmed as calmed
    from dreamdrive.geometry.measured import Measured as Measured
    from dreamdrive.geometry.options import (
        DepthOptions as DepthOptions,
        GateOptions as GateOptions,
        GeometryOptions as GeometryOptions,
        MovingOptions as MovingOptions,
    )
    from dreamdrive.geometry.protocol import GeometryBackend as GeometryBackend
    from dreamdrive.geometry.reconstruct import backend_of as backend_of, reconstruct as reconstruct
    from dreamdrive.geometry.table import BACKENDS as BACKENDS

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
