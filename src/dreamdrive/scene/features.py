"""Z_ref: what is known of each pixel beside its colour."""

import cv2
import numpy as np
from jaxtyping import Float

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry

OF_GEOMETRY = 2
"""Leading channels that geometry gives: moving evidence and confidence. Those of the clip's frames follow."""


def pixel_features(clip: Clip, geometry: Geometry, frame: int) -> Float[np.ndarray, "h w c"]:
    """Z_ref of one frame at the frame's size: what geometry gives, then all features of the clip by name."""
    size = clip.size
    maps = [geometry.moving[frame][..., None], geometry.confidence[frame][..., None]]
    for name in sorted(clip.features):
        feature = np.asarray(clip.features[name][frame], dtype=np.float32)
        resized = cv2.resize(feature, size, interpolation=cv2.INTER_LINEAR)
        maps.append(resized.reshape(size[1], size[0], -1))
    return np.concatenate(maps, axis=2).astype(np.float32)
