"""Frames as a video model would have drawn them: what is wrong with generated video, put on a true clip."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from streetworld.corruption.effects import corrupt as corrupt
    from streetworld.corruption.settings import (
        PRESETS as PRESETS,
        Corruption as Corruption,
        parse_corruption as parse_corruption,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
