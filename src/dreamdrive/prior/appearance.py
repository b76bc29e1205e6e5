"""Per-pixel appearance at several scales: the features Z_ref of a recorded clip."""

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float16, Float32, UInt8

STRIDE = 2
"""Frame pixels per feature pixel; clips have even sizes, so it divides them."""
SCALES_PX = (1.0, 3.0, 9.0)
"""Standard deviations of the neighbourhoods, in feature pixels: a wheel, a car far off, a car nearby."""
NAMES = tuple(
    f"{name} at {scale:g} px"
    for scale in SCALES_PX
    for name in ("L", "a", "b", "gradient of L", "contrast of L")
)
"""What each channel holds, in order."""
FLAT = 0.1
"""Deviation, in units of Lab, below which a channel says nothing: grey clips reach 0.03 in a and b by
rounding, while real clips have 0.5 or more in every channel."""


def appearance(
    frames: UInt8[np.ndarray, "f h w 3"], valid: Bool[np.ndarray, "f h w"]
) -> Float16[np.ndarray, "f _ _ _"]:
    """Colour, edge strength and contrast in neighbourhoods of three sizes.

    Per scale five channels (``NAMES``): mean CIE Lab colour, size of the gradient of the mean lightness, and
    standard deviation of the lightness. Neighbourhoods leave out invalid pixels. Each channel is shifted and
    scaled to mean 0 and variance 1 over the valid pixels of the clip; a channel without variance is 0. Of RGB
    frames of even sides come features (F, H // 2, W // 2, 15), 0 where not valid.
    """
    count, height, width = valid.shape
    if height % STRIDE or width % STRIDE:
        raise ValueError(f"appearance: expected an even size, got {width}x{height}")
    features = np.empty((count, height // STRIDE, width // STRIDE, len(NAMES)), dtype=np.float16)
    sums = np.zeros((2, len(NAMES)))
    seen = 0
    weights = [_shrink(mask.astype(np.float32)) for mask in valid]
    for index, (frame, weight) in enumerate(zip(frames, weights, strict=True)):
        values = _describe(frame, valid[index], weight)
        features[index] = values
        inside = values[weight > 0].astype(np.float64)
        sums += inside.sum(axis=0), (inside**2).sum(axis=0)
        seen += len(inside)
    mean = sums[0] / max(seen, 1)
    deviation = np.sqrt(np.maximum(sums[1] / max(seen, 1) - mean**2, 0.0))
    scale = np.where(deviation > FLAT, 1 / np.maximum(deviation, FLAT), 0.0)
    for index, weight in enumerate(weights):
        features[index] = (features[index] - mean) * scale * (weight > 0)[..., None]
    return features


def _describe(
    frame: UInt8[np.ndarray, "h w 3"], valid: Bool[np.ndarray, "h w"], weight: Float32[np.ndarray, "h2 w2"]
) -> Float32[np.ndarray, "h2 w2 c"]:
    """The raw channels of one frame; L in [0, 100]."""
    lab = np.asarray(cv2.cvtColor(frame.astype(np.float32) / 255, cv2.COLOR_RGB2LAB), dtype=np.float32)
    lab = _shrink(lab * valid[..., None]) / np.maximum(weight, 1e-6)[..., None]
    square = lab[..., :1] ** 2
    stack = np.concatenate([lab, square], axis=-1) * weight[..., None]
    channels: list[Float[np.ndarray, "h w"]] = []
    for scale in SCALES_PX:
        share = np.maximum(_blur(weight, scale), 1e-6)
        mean = _blur(stack, scale) / share[..., None]
        lightness = np.ascontiguousarray(mean[..., 0])
        gradient = np.hypot(*(cv2.Sobel(lightness, cv2.CV_32F, x, 1 - x, scale=1 / 8) for x in (1, 0)))
        contrast = np.sqrt(np.maximum(mean[..., 3] - lightness**2, 0.0))
        channels += [lightness, mean[..., 1], mean[..., 2], gradient, contrast]
    return np.stack(channels, axis=-1).astype(np.float32)


def _shrink(image: Float32[np.ndarray, "h w *c"]) -> Float32[np.ndarray, "h2 w2 *c"]:
    size = (image.shape[1] // STRIDE, image.shape[0] // STRIDE)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.float32)


def _blur(image: Float32[np.ndarray, "h w *c"], scale_px: float) -> Float32[np.ndarray, "h w *c"]:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), scale_px, borderType=cv2.BORDER_REFLECT_101))
