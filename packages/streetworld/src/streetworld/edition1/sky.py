"""Sun, sky and haze of edition 1."""

import numpy as np

from dreamdrive.scene.street.layout import Light
from streetworld.engine.paint import noise
from streetworld.engine.sky import SkyLight

_SHAPE = (128, 512)
_SUN = np.array([1.0, 0.94, 0.84], np.float32)
_ZENITH, _HORIZON, _CLOUD = (
    np.array(c, np.float32) / 255 for c in ([84, 134, 204], [204, 218, 232], [238, 240, 244])
)


def make_sky(light: Light, seed: int) -> SkyLight:
    """The sky of a layout."""
    rng = np.random.default_rng([seed, 2])
    height, width = _SHAPE
    azimuth, elevation = light.sun_azimuth_rad, light.sun_elevation_rad
    flat = np.cos(elevation)
    towards = np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)])
    up = np.linspace(1, 0, height, dtype=np.float32)[:, None, None]
    blue = _ZENITH * up**0.6 + _HORIZON * (1 - up**0.6)
    field = noise(rng, (height, width + 64), {6: 0.08, 20: 0.25, 70: 0.5})
    blend = np.linspace(0, 1, 64, dtype=np.float32)
    field[:, :64] = field[:, :64] * blend + field[:, width:] * (1 - blend)  # no seam at the full turn
    cloud = np.clip(field[:, :width] + 1.6 * light.clouds - 0.6, 0, 1)[..., None]
    panorama = blue + 0.85 * cloud * (_CLOUD - blue)
    turn = np.linspace(0, 2 * np.pi, width, dtype=np.float32)[None]
    rise = np.linspace(np.pi / 2, 0, height, dtype=np.float32)[:, None]
    near = np.cos(rise) * flat * np.cos(turn - azimuth) + np.sin(rise) * np.sin(elevation)
    glow = light.sun * (0.25 * np.exp((near - 1) * 8) + 0.8 * np.exp((near - 1) * 300))
    panorama = panorama**2 + glow[..., None] * _SUN
    haze = (panorama[-8:].mean(axis=(0, 1)) * 0.9).astype(np.float32)
    return SkyLight(
        panorama=panorama.astype(np.float32),
        towards_sun=towards,
        sunlight=(2.1 * light.sun * _SUN).astype(np.float32),
        skylight=((1.25 - 0.75 * light.sun) * np.array([0.92, 0.97, 1.05], np.float32)).astype(np.float32),
        haze_per_m=light.haze_per_m,
        haze=haze,
    )
