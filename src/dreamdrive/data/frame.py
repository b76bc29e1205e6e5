"""A frame as it comes out of a file, before sizing and undistortion."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, UInt8


@dataclass(frozen=True)
class RawFrame:
    """One picture at its own size, turned upright.

    Attributes:
        index: Index in the source, in file or decode order.
        name: What to call it in messages.
        rgb: The picture (H, W, 3).
        opaque: False where the file marks the pixel as transparent (H, W); ``None`` where nothing is.
        time_s: Seconds since frame 0 of the source, or ``None`` where the file has no clock.
        notes: What the report should say about the file, a sentence each.
        damaged: Whether the decoder patched it up, or built it upon a frame that it patched up.
    """

    index: int
    name: str
    rgb: UInt8[np.ndarray, "h w 3"]
    opaque: Bool[np.ndarray, "h w"] | None = None
    time_s: float | None = None
    notes: tuple[str, ...] = ()
    damaged: bool = False

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.rgb.shape[1], self.rgb.shape[0]
