"""Small recordings made on the spot."""

from collections.abc import Callable
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from tests.data.textures import texture


@pytest.fixture
def make_folder(tmp_path: Path) -> Callable[..., Path]:
    """Write images to a folder; a list of arrays (RGB or grey) or a number of frames."""

    def make(images: list[np.ndarray] | int = 6, size=(64, 48), suffix=".png", name="frames") -> Path:
        folder = tmp_path / name
        folder.mkdir()
        if isinstance(images, int):
            images = [texture(size[1], size[0], seed) for seed in range(images)]
        for index, image in enumerate(images):
            swapped = image[..., [2, 1, 0, 3][: image.shape[2]]] if image.ndim == 3 else image
            assert cv2.imwrite(str(folder / f"{index}{suffix}"), swapped)
        return folder

    return make


@pytest.fixture
def make_video(tmp_path: Path) -> Callable[..., Path]:
    """Write an H.264 video whose frame i is grey 40 + 3 i with a bright left half."""

    def make(count=12, size=(64, 48), rate=20, name="clip.mp4", **options: str) -> Path:
        path = tmp_path / name
        with av.open(str(path), "w", options=options) as container:
            stream = container.add_stream("libx264", rate=rate, options={"crf": "8"})
            stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
            for index in range(count):
                image = np.full((size[1], size[0], 3), 40 + 3 * index, dtype=np.uint8)
                image[:, : size[0] // 2] += 80
                container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
            container.mux(stream.encode())
        return path

    return make
