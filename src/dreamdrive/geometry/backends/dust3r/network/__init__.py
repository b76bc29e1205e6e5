"""The network: weights from a file, frames to pictures, pictures to pointmaps of pairs."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.geometry.backends.dust3r.network.checkpoint import load_dust3r as load_dust3r
    from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r as Dust3r
    from dreamdrive.geometry.backends.dust3r.network.images import resize_crop as resize_crop
    from dreamdrive.geometry.backends.dust3r.network.inference import (
        BUDGET_BYTES as BUDGET_BYTES,
        infer as infer,
    )
    from dreamdrive.geometry.backends.dust3r.network.memory import plan_memory as plan_memory

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
