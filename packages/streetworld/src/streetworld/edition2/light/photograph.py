"""Photographs: a camera's processing of light, for pictures to train on, each with its own."""

import cv2
import numpy as np
from jaxtyping import UInt8


def photograph(frame: UInt8[np.ndarray, "h w 3"], seed: int) -> UInt8[np.ndarray, "h w 3"]:
    """The picture as some camera would have taken it. Nothing is moved, so that labels stay true.

    Blur of motion and focus, colour fringes, white balance, contrast, vignetting, noise, compression.
    """
    rng = np.random.default_rng([seed, 51])
    image = (frame.astype(np.float32) / 255) ** 2
    height, width = image.shape[:2]
    image = _blurred(rng, image)
    if rng.random() < 0.3:
        image = _fringes(rng, image)
    image = image * np.exp(rng.normal(0, 0.22)) * np.exp(rng.normal(0, 0.06, 3)).astype(np.float32)
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-height / width, height / width, height))
    image = image * (1 - rng.uniform(0, 0.35) * (x**2 + y**2)).astype(np.float32)[..., None]
    grey = image.mean(axis=-1, keepdims=True)
    image = np.maximum(grey + np.float32(np.exp(rng.normal(0, 0.22))) * (image - grey), 0)
    image = _noisy(rng, image)
    shown = np.clip(image, 0, 1.2) ** np.float32(0.5 * np.exp(rng.normal(0, 0.14)))
    steep = np.float32(rng.uniform(-0.25, 0.6))
    shown = shown + steep * shown * (1 - shown) * (shown - np.float32(0.45)) * 2
    shown = shown * np.float32(1 - rng.exponential(0.02)) + np.float32(rng.exponential(0.015))
    if rng.random() < 0.35:
        soft = cv2.GaussianBlur(shown, (0, 0), 1.0)
        shown = shown + np.float32(rng.uniform(0.2, 1.2)) * (shown - soft)
    made = np.clip(np.rint(255 * shown), 0, 255).astype(np.uint8)
    return _compressed(rng, made)


def _blurred(rng: np.random.Generator, image: np.ndarray) -> np.ndarray:
    """Out of focus, or moved while exposed; most pictures hardly are."""
    width = image.shape[1]
    sigma = rng.exponential(0.0007) * width
    if sigma > 0.25:
        image = cv2.GaussianBlur(image, (0, 0), min(sigma, 0.003 * width))
    if rng.random() < 0.2:
        long = max(3, int(rng.uniform(0.003, 0.014) * width) | 1)
        kernel = np.zeros((long, long), np.float32)
        angle = rng.normal(0, 0.4)
        out = 0.5 * (long - 1) * np.array([np.cos(angle), np.sin(angle)])
        start, end = ((0.5 * (long - 1) + s * out).round().astype(int).tolist() for s in (-1, 1))
        cv2.line(kernel, start, end, (1.0,), 1)
        image = cv2.filter2D(image, -1, kernel / kernel.sum())
    return image


def _fringes(rng: np.random.Generator, image: np.ndarray) -> np.ndarray:
    """Red and blue a little larger or smaller than green."""
    height, width = image.shape[:2]
    channels = list(cv2.split(image))
    for k in (0, 2):
        grow = 1 + rng.normal(0, 0.0012)
        matrix = np.array([[grow, 0, (1 - grow) * width / 2], [0, grow, (1 - grow) * height / 2]])
        channels[k] = cv2.warpAffine(channels[k], matrix, (width, height), borderMode=cv2.BORDER_REPLICATE)
    return cv2.merge(channels)


def _noisy(rng: np.random.Generator, image: np.ndarray) -> np.ndarray:
    """Shot and read noise, sometimes in blotches as after a filter."""
    height, width = image.shape[:2]
    level = rng.exponential(0.012)
    cells = (height, width) if rng.random() < 0.6 else (height // 2 + 1, width // 2 + 1)
    grain = rng.standard_normal((*cells, 3), dtype=np.float32)
    if cells[0] != height:
        grain = cv2.resize(grain, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.maximum(image + np.float32(level) * grain * np.sqrt(image + np.float32(0.02)), 0)


def _compressed(rng: np.random.Generator, image: np.ndarray) -> np.ndarray:
    """Through a JPEG file, now and then a smaller one."""
    height, width = image.shape[:2]
    if rng.random() < 0.2:
        share = rng.uniform(0.45, 0.9)
        small = cv2.resize(image, (int(width * share), int(height * share)), interpolation=cv2.INTER_AREA)
        image = cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR)
    quality = int(rng.uniform(25, 96))
    _, packed = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    unpacked = cv2.imdecode(packed, cv2.IMREAD_COLOR)
    assert unpacked is not None
    return np.ascontiguousarray(unpacked[..., ::-1])
