"""Cameras that several frames share."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int

from dreamdrive.data.camera_models import LensCamera, lens_key


def different(found: Sequence[LensCamera]) -> tuple[tuple[LensCamera, ...], Int[np.ndarray, " f"]]:
    """The different ones of the cameras of all frames, and the index of each frame's own (F,)."""
    place: dict[tuple[object, ...], int] = {}
    index = [place.setdefault(lens_key(each), len(place)) for each in found]
    first = [index.index(each) for each in range(len(place))]
    return tuple(found[frame] for frame in first), np.array(index, np.intp)
