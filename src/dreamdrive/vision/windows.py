"""Windows that cover the same part of a picture whatever its width."""

FROM_WIDTH_PX = 480
"""Wider pictures have larger windows. In narrower ones they stay: fewer pixels would tell nothing."""


def grown(length_px: float, width_px: int) -> float:
    """A length in pixels, chosen for pictures up to ``FROM_WIDTH_PX`` wide, in one of this width."""
    return length_px * max(1.0, width_px / FROM_WIDTH_PX)


def window_px(side_px: int, width_px: int) -> int:
    """Side of a square window, odd, in a picture of this width."""
    return 2 * round((grown(side_px, width_px) - 1) / 2) + 1
