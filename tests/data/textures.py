"""Pictures for tests."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np


def texture(height: int, width: int, seed: int = 0) -> np.ndarray:
    """A smooth random RGB picture with edges of a few pixels."""
    coarse = np.random.default_rng(seed).integers(
        0, 256, (height // 12 + 2, width // 12 + 2, 3), dtype=np.uint8
    )
    return cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)


def approach(seed: int = 0, count: int = 6, size: tuple[int, int] = (160, 96)) -> np.ndarray:
    """A drive towards a picture: 3 % nearer with each frame."""
    picture = texture(size[1], size[0], seed)
    middle = (size[0] / 2, size[1] / 2)
    nearer = [cv2.getRotationMatrix2D(middle, 0, 1.03**index) for index in range(count)]
    return np.stack(
        [cv2.warpAffine(picture, matrix, size, borderMode=cv2.BORDER_REFLECT) for matrix in nearer]
    )


def write_video(
    path: Path,
    pictures: Sequence[np.ndarray],
    *,
    codec: str = "libx264",
    rate: int = 20,
    kind: str | None = None,
    aspect: Fraction | None = None,
    **options: str,
) -> Path:
    """Encode pictures as a video; ``kind`` is its format, ``aspect`` the shape of its pixels."""
    with av.open(str(path), "w", format=kind) as container:
        stream = container.add_stream(codec, rate=rate, options=options)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        if aspect is not None:
            stream.codec_context.sample_aspect_ratio = aspect
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    return path
