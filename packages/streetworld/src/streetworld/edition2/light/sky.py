"""Sun, clouds, dusk and night of edition 2."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float

from dreamdrive.scene.street.layout import Layout, Light
from streetworld.edition2.light.textures import TextureLibrary
from streetworld.engine.paint import noise
from streetworld.engine.sky import SkyLight

_SHAPE = (256, 1280)
_SHARE_CUT = 0.55  # of the skies by day that are cut from pictures, where there are any
_TRIES, _GREY, _DULL = 8, 0.22, 0.25
"""How often a cut sky is drawn until it fits: one whose colours differ by less than the second number where
the share of the sun is less than the third."""
_EVEN = 1.25
"""Light on level ground that the camera exposes for."""
_ADAPTED = 0.75
"""How far it does: 1 makes all streets equally bright."""


@dataclass(frozen=True)
class Tones:
    """Colours of the light, linear."""

    sun: Float[np.ndarray, "3"]
    ambient: Float[np.ndarray, "3"]
    zenith: Float[np.ndarray, "3"]
    horizon: Float[np.ndarray, "3"]
    cloud: Float[np.ndarray, "3"]


def _mix(a: object, b: object, share: float) -> np.ndarray:
    return np.asarray(a, np.float32) * (1 - share) + np.asarray(b, np.float32) * share


def _tones(rng: np.random.Generator, light: Light) -> Tones:
    """By the height of the sun, the clouds and the night, and a cast that differs from camera to camera."""
    low = float(np.clip((0.45 - light.sun_elevation_rad) / 0.4, 0, 1))
    grey = 1 - light.sun
    blue = _mix(rng.uniform((0.03, 0.11, 0.36), (0.16, 0.3, 0.62)), (0.62, 0.66, 0.72), grey**1.5)
    pale = _mix(rng.uniform((0.45, 0.58, 0.74), (0.75, 0.85, 0.98)), (0.85, 0.87, 0.9), grey)
    pale = _mix(pale, rng.uniform((0.75, 0.42, 0.25), (1.0, 0.7, 0.5)), low * light.sun)
    cloud = _mix((1.0, 1.0, 1.02), rng.uniform(0.7, 1.25) * np.array([0.97, 0.99, 1.02]), grey)
    cloud = _mix(cloud, (0.9, 0.62, 0.5), 0.5 * low * light.sun)
    town = rng.uniform(0.015, 0.06) * np.array([1.0, rng.uniform(0.72, 1.0), rng.uniform(0.6, 1.2)])
    dark = light.night**0.5
    cast = np.exp(rng.normal(0, 0.07, 3)).astype(np.float32)
    sun = _mix((1.0, 0.95, 0.86), (1.0, 0.6, 0.3), low) * 2.1 * light.sun * (1 - light.night) ** 2
    ambient = _mix((0.94, 0.97, 1.04), (0.8, 0.9, 1.2), light.sun) * (1.25 - 0.75 * light.sun)
    ambient = ambient * (1 - 0.965 * dark) + rng.uniform(0, 0.04, 3) * light.night
    return Tones(
        sun=sun * cast,
        ambient=ambient * cast,
        zenith=_mix(blue, 0.4 * town, dark) * cast,
        horizon=_mix(pale, town * rng.uniform(0.8, 2.2), dark) * cast,
        cloud=_mix(cloud, 1.3 * town, dark) * cast,
    )


def make_sky(layout: Layout, textures: TextureLibrary | None) -> SkyLight:
    """The sky of a layout: painted, or cut from a picture and painted above it."""
    light, rng = layout.light, np.random.default_rng([layout.seed, 22])
    tones = _tones(rng, light)
    flat, rise = np.cos(light.sun_elevation_rad), np.sin(light.sun_elevation_rad)
    azimuth = light.sun_azimuth_rad
    towards = np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), rise])
    level = float((tones.sun * rise + tones.ambient).mean())
    gain = np.float32((_EVEN / max(level, 0.3)) ** (_ADAPTED * (1 - light.night)) * rng.uniform(0.75, 1.25))
    panorama = _painted(rng, light, tones)
    if textures is not None and light.night < 0.3 and rng.random() < _SHARE_CUT:
        panorama = _cut(rng, panorama, textures, layout.seed, light.sun)
    panorama = panorama + _sun(light, tones, panorama.shape[:2])
    if light.haze_per_m > 0.006:
        veil = np.linspace(0, 1, len(panorama), dtype=np.float32)[:, None, None] ** 2
        share = min(0.95, 60 * light.haze_per_m) * np.sqrt(veil)
        panorama = panorama + share * (panorama[-8:].mean(axis=(0, 1)) - panorama)
    panorama = panorama * gain
    haze = (panorama[-10:].mean(axis=(0, 1)) * 0.92).astype(np.float32)
    return SkyLight(
        panorama=panorama.astype(np.float32),
        towards_sun=towards,
        sunlight=(tones.sun * gain).astype(np.float32),
        skylight=(tones.ambient * gain).astype(np.float32),
        haze_per_m=light.haze_per_m,
        haze=haze,
    )


def _painted(rng: np.random.Generator, light: Light, tones: Tones) -> np.ndarray:
    """Blue or grey, with clouds that lie flatter towards the horizon."""
    height, width = _SHAPE
    up = np.linspace(1, 0, height, dtype=np.float32)[:, None, None]
    curve = up ** rng.uniform(0.35, 0.9)
    image = tones.zenith * curve + tones.horizon * (1 - curve)
    field = noise(rng, (height, width + 96), {5: 0.05, 14: 0.1, 40: 0.24, 130: 0.4, 330: 0.3})
    blend = np.linspace(0, 1, 96, dtype=np.float32)
    field[:, :96] = field[:, :96] * blend + field[:, width:] * (1 - blend)  # no seam at the full turn
    field = field[:, :width]
    # Clouds above are seen from near: rows are stretched away from the horizon.
    rows = (1 - (1 - np.linspace(0, 1, height)) ** 0.6) * (height - 1)
    across = np.arange(width, dtype=np.float32)[None] + 0 * rows[:, None]
    field = cv2.remap(
        field, across.astype(np.float32), (rows[:, None] + 0 * across).astype(np.float32), cv2.INTER_LINEAR
    )
    edge = rng.uniform(0.8, 2.5)
    cover = np.clip(edge * (field + 2.2 * light.clouds - 1.0) + 0.3, 0, 1)[..., None]
    shade = np.clip(1 - 0.16 * cover * (1 + cv2.GaussianBlur(field, (0, 0), 6)[..., None]), 0.6, 1.1)
    return (image + 0.92 * cover * (tones.cloud * shade - image)).astype(np.float32)


def _cut(
    rng: np.random.Generator, painted: np.ndarray, textures: TextureLibrary, seed: int, sun: float
) -> np.ndarray:
    """A strip of a real sky above the horizon, mirrored around the turn and upwards, plainer above."""
    for _ in range(_TRIES):
        found = textures.pick("sky", seed, rng)
        if found is None:
            return painted
        mean = found[0].mean(axis=(0, 1))
        if (mean.max() - mean.min() < _GREY * mean.max()) == (sun < _DULL):
            break
    else:
        return painted
    strip = (found[0].astype(np.float32) / 255) ** 2
    strip *= np.float32((rng.uniform(0.45, 0.95) / max(float(strip.mean()), 0.02)) ** 0.7)
    height, width = _SHAPE
    times = 2 * max(2, round(360 / found[1].width_m / 2 * rng.uniform(0.7, 1.3)))
    wide = -(-width // times)
    degrees = found[1].width_m * strip.shape[0] / strip.shape[1]
    rise = int(np.clip(degrees / 90 * height * rng.uniform(0.9, 1.5), 0.1 * height, 0.6 * height))
    one = cv2.resize(strip, (wide, rise), interpolation=cv2.INTER_AREA)
    if rng.random() < 0.5:
        one = one[:, ::-1]
    turn = np.concatenate([one, one[:, ::-1]] * (times // 2), axis=1)
    turn = np.roll(cv2.resize(turn, (width, rise)), int(rng.integers(width)), axis=1) * rng.uniform(
        0.85, 1.15
    )
    tower = np.concatenate([turn[::-1], turn] * (-(-height // (2 * rise)) + 1), axis=0)[-height:]
    above = np.clip(np.linspace(1.4, -0.4, height, dtype=np.float32), 0, 1)[:, None, None]
    return (tower + above * (turn[: rise // 3 + 1].mean(axis=(0, 1)) - tower)).astype(np.float32)


def _sun(light: Light, tones: Tones, shape: tuple[int, int]) -> np.ndarray:
    """The disc of the sun and the glow around it."""
    height, width = shape
    flat, rise = np.cos(light.sun_elevation_rad), np.sin(light.sun_elevation_rad)
    turn = np.linspace(0, 2 * np.pi, width, dtype=np.float32)[None]
    up = np.linspace(np.pi / 2, 0, height, dtype=np.float32)[:, None]
    near = np.cos(up) * flat * np.cos(turn - light.sun_azimuth_rad) + np.sin(up) * rise
    sharp = (1 - light.clouds) * 2.0 * np.exp((near - 1) * 900)
    glow = 0.12 * np.exp((near - 1) * 6) + 0.35 * np.exp((near - 1) * 60) + sharp
    return (light.sun * (1 - light.night) ** 2 * glow)[..., None] * tones.sun
