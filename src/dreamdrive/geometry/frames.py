"""Whether the frames of a clip can be given to a network that measures geometry."""

import numpy as np

from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip

_ALIKE = 1.0  # grey levels


def check_frames(clip: Clip, backend: str) -> None:
    """Refuse what no network can find cameras in.

    Raises:
        InputError: Fewer than two frames, or frames that are all alike.
    """
    if len(clip) < 2:
        raise InputError(f"geometry {backend} takes two frames or more; got {len(clip)}")
    first = clip.frames[0].astype(np.int16)
    if all(float(np.abs(frame - first).mean()) < _ALIKE for frame in clip.frames[1:]):
        raise InputError(
            f"geometry {backend}: all {len(clip)} frames are alike, which shows neither path nor depth; "
            "take frames between which the camera moves"
        )
