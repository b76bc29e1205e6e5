"""Changes of colour by cameras, weather and codecs, of one and the same view."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import UInt8

Rgb = UInt8[np.ndarray, "h w 3"]


@dataclass(frozen=True)
class ColourOptions:
    """Shares are of the pictures that a change befalls, sizes its standard deviation or its range."""

    gamma: float = 0.3
    """Of the logarithm of the exponent: exposures of cameras differ by as much."""
    contrast: float = 0.25
    """Of the logarithm of the contrast about the mean grey."""
    brightness: float = 0.12
    """Of what is added, in shares of white."""
    tint: float = 0.08
    """Of the logarithm of each channel's gain: white balance."""
    saturation: tuple[float, float] = (0.2, 1.6)
    hue_share: float = 0.2
    hue_deg: float = 14.0
    grey_share: float = 0.05
    blur_share: float = 0.25
    blur_px: tuple[float, float] = (0.4, 1.8)
    coarse_share: float = 0.15
    """Made smaller and larger again, as video of low rate is."""
    coarse: tuple[float, float] = (0.35, 0.8)
    noise_share: float = 0.3
    noise: tuple[float, float] = (2.0, 14.0)
    jpeg_share: float = 0.35
    jpeg: tuple[int, int] = (15, 80)
    exchange_share: float = 0.4
    """Drawn pictures that take the coarse light of a real one (Yang and Soatto 2020)."""
    exchange: tuple[int, int] = (1, 4)
    """Waves across the picture up to which amplitudes are exchanged."""


def recoloured(rgb: Rgb, generator: np.random.Generator, options: ColourOptions) -> Rgb:
    """The same view by another camera, in another light."""
    rgb = _toned(rgb, generator, options)
    if generator.random() < options.blur_share:
        rgb = cv2.GaussianBlur(rgb, (0, 0), generator.uniform(*options.blur_px))
    if generator.random() < options.coarse_share:
        scale = generator.uniform(*options.coarse)
        small = cv2.resize(rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        rgb = cv2.resize(small, rgb.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    if generator.random() < options.noise_share:
        # A tile of noise, rolled, instead of a number for each pixel.
        noise = generator.standard_normal((64, 64, 3), np.float32) * generator.uniform(*options.noise)
        tiles = -(-rgb.shape[0] // 64), -(-rgb.shape[1] // 64), 1
        noise = np.tile(noise, tiles)[: rgb.shape[0], : rgb.shape[1]]
        rgb = np.clip(rgb + noise, 0, 255).astype(np.uint8)
    if generator.random() < options.jpeg_share:
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(generator.integers(*options.jpeg))]
        rgb = np.asarray(cv2.imdecode(cv2.imencode(".jpg", rgb, quality)[1], cv2.IMREAD_COLOR))
    return rgb


def _toned(rgb: Rgb, generator: np.random.Generator, options: ColourOptions) -> Rgb:
    """Hue, saturation, and a curve for each channel."""
    if generator.random() < options.hue_share:
        hsv = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)
        turn = round(generator.normal() * options.hue_deg / 2)  # OpenCV counts half degrees, of 180
        hsv[..., 0] = (hsv[..., 0].astype(np.int16) + turn) % 180
        rgb = cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)
    grey = cv2.cvtColor(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
    saturation = generator.uniform(*options.saturation)
    if generator.random() < options.grey_share:
        saturation = 0.0
    rgb = cv2.addWeighted(rgb, saturation, grey, 1 - saturation, 0)
    steps = np.linspace(0, 1, 256)[:, None] * np.exp(generator.normal(size=3) * options.tint)
    curve = np.clip(steps, 0, None) ** np.exp(generator.normal() * options.gamma)
    curve = (curve - 0.5) * np.exp(generator.normal() * options.contrast) + 0.5
    curve = curve + generator.normal() * options.brightness
    table = np.clip(np.rint(curve * 255), 0, 255).astype(np.uint8)
    return np.asarray(cv2.LUT(rgb, table[:, None, :]))


def exchanged(rgb: Rgb, light: Rgb, waves: int) -> Rgb:
    """The picture with the amplitudes of the coarse waves of another (Fourier domain adaptation).

    What changes is smooth, so that it is found on small copies and added.
    """
    side = 64
    small, other = (cv2.resize(each, (side, side), interpolation=cv2.INTER_AREA) for each in (rgb, light))
    own = np.fft.rfft2(small.astype(np.float32), axes=(0, 1))
    theirs = np.abs(np.fft.rfft2(other.astype(np.float32), axes=(0, 1)))
    low = (np.abs(np.fft.fftfreq(side, 1 / side))[:, None] <= waves) & (np.arange(side // 2 + 1) <= waves)
    new = np.where(low[..., None], theirs * np.exp(1j * np.angle(own)), own)
    change = (np.fft.irfft2(new, s=(side, side), axes=(0, 1)) - small).astype(np.float32)
    large = cv2.resize(change, rgb.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    return np.clip(rgb + large, 0, 255).astype(np.uint8)
