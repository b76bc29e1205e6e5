"""Completion: what views aside would meet and no frame saw, put in space as a guess."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.complete.complete import CompletionOptions as CompletionOptions, completed as completed
    from dreamdrive.complete.surface import surface as surface

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
