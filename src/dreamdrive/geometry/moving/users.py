"""What moves are whole road users."""

import numpy as np
from jaxtyping import Float

from dreamdrive.geometry.moving.evidence import FLAGGED
from dreamdrive.scene.look import Look

_MOVING_SHARE = 0.4  # of a road user's pixels, from which on all of it moves
_SURE = 0.8  # trust in a class, from which on it is believed that a pixel is no road user


def whole_users(moving: Float[np.ndarray, "f h w"], look: Look) -> Float[np.ndarray, "f h w"]:
    """Evidence of motion in [0, 1] with each road user moving as a whole or not at all.

    What surely is none does not move.
    """
    whole = moving.copy()
    for frame, evidence in enumerate(whole):
        labels, flagged = look.instances[frame], evidence >= FLAGGED
        counts = np.bincount(labels.ravel())
        share = np.bincount(labels[flagged], minlength=len(counts)) / np.maximum(counts, 1)
        moves = share > _MOVING_SHARE
        street = (labels == 0) & (look.confidence[frame] >= _SURE)
        stays = street | ((labels > 0) & ~moves[labels])
        evidence[stays] = np.minimum(evidence[stays], 0.9 * FLAGGED)
        goes = (labels > 0) & moves[labels]
        evidence[goes] = np.maximum(evidence[goes], FLAGGED)
    return whole
