"""Evidence in the frames alone: features, motion, regions fixed to the camera."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.geometry.evidence import features as features
    from dreamdrive.geometry.evidence.features import Features as Features
    from dreamdrive.geometry.evidence.motion import track as track
    from dreamdrive.geometry.evidence.observation import (
        Evidence as Evidence,
        find_features as find_features,
        free_pixels as free_pixels,
        observe as observe,
        resized as resized,
        shows_little as shows_little,
        working_frames as working_frames,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
