"""How large the pictures of a moving camera may be, so that enough of them come."""

from dataclasses import dataclass, field

MOVING_PX = 480 * 270
"""Most pixels of a picture while the camera moves."""
LEAST_PX = 240 * 135
RESTING_PX = 1280 * 800
"""Most pixels of one when it rests."""
LEAST_HZ = 15.0
"""Pictures a second while the camera moves; smaller ones are made where a machine is slow."""
_STEP, _ROOM = 0.8, 0.6


@dataclass
class PictureSize:
    """The size of moving pictures, by what the last ones took."""

    _px: float = field(default=MOVING_PX, init=False)

    def took(self, seconds: float) -> None:
        """Tell how long a moving picture took; they become smaller at once and larger where there is room."""
        budget_s = 1 / LEAST_HZ
        if seconds > budget_s:
            self._px = max(LEAST_PX, self._px * _STEP)
        elif seconds < _ROOM * budget_s:
            self._px = min(MOVING_PX, self._px / _STEP)

    def size(self, window: tuple[int, int], resting: bool) -> tuple[int, int]:
        """Width and height of a picture in a window of that size; no larger than it, and of its shape."""
        width, height = (max(2, side) for side in window)
        most = RESTING_PX if resting else self._px
        scale = min(1.0, (most / (width * height)) ** 0.5)
        return max(2, int(width * scale)), max(2, int(height * scale))
