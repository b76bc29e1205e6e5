"""Samples of perception in pictures: what the cameras show, and the labels from above."""

import cv2
import numpy as np
from jaxtyping import UInt8

from dreamdrive.perception import LAYERS, BevLabels, BevSample
from dreamdrive.show.panels import Image, grid

_COLOURS = {
    "road_segment": (150, 150, 158),
    "lane": (178, 178, 186),
    "road_divider": (214, 160, 30),
    "lane_divider": (236, 236, 240),
    "pedestrian": (255, 70, 90),
    "bicycle": (20, 170, 100),
    "motorcycle": (20, 150, 160),
    "car": (70, 150, 255),
    "truck": (255, 160, 40),
    "bus": (220, 60, 180),
    "trailer": (255, 200, 90),
    "construction": (200, 200, 60),
}
"""Of layers, from below to above."""
_GROUND, _EGO = (30, 32, 36), (210, 30, 60)
_FAINT = 0.45
"""How bright vehicles are that are hardly visible."""


def draw_labels(labels: BevLabels) -> UInt8[np.ndarray, "rows columns 3"]:
    """Cells in the colours of their layers; vehicles of which less than 40 % are visible are dark."""
    image = np.full((*labels.visibility.shape, 3), _GROUND, np.uint8)
    for name, colour in _COLOURS.items():
        image[labels.layers[LAYERS.index(name)] > 0] = colour
    hidden = labels.visibility < 2
    image[hidden] = (image[hidden] * _FAINT).astype(np.uint8)
    rows, columns = labels.visibility.shape
    cv2.drawMarker(image, (columns // 2, rows // 2), _EGO, cv2.MARKER_TRIANGLE_UP, 7, 1)
    return image


def draw_sample(sample: BevSample, names: list[str]) -> UInt8[np.ndarray, "h2 w2 3"]:
    """The pictures of all cameras in rows of three, and the labels to their right."""
    pictures = {
        name: np.ascontiguousarray(picture.transpose(1, 2, 0))
        for name, picture in zip(names, sample.pictures, strict=True)
    }
    cameras = grid(pictures, columns=min(3, len(pictures)))
    height = cameras.shape[0]
    seen: Image = np.asarray(
        cv2.resize(draw_labels(sample.labels), (height, height), interpolation=cv2.INTER_NEAREST), np.uint8
    )
    return np.concatenate([cameras, seen], axis=1)
