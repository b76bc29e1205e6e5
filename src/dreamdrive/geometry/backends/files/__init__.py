"""Geometry that the user brings as files: poses, intrinsics and depth, in the common formats."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.geometry.backends.files.attach import attach as attach
    from dreamdrive.geometry.backends.files.formats import (
        EXPECTED as EXPECTED,
        bent_model as bent_model,
        companions as companions,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
