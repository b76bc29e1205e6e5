"""Weather, light and hills of the second edition."""

import numpy as np

from dreamdrive.scene.street.hills import STEEPEST
from dreamdrive.scene.street.layout import Light, Relief
from streetworld.edition2.layouts.kinds import chosen

_WEATHER = {
    "clear": 0.36,
    "overcast": 0.2,
    "low sun": 0.12,
    "dusk": 0.06,
    "night": 0.09,
    "rain": 0.08,
    "fog": 0.04,
    "snow": 0.05,
}
_FAIR = {"clear": 0.6, "overcast": 0.4}
_SLOPE = (0.015, 0.1)  # where all waves rise together, which is rare: half of it is common
_LENGTH_M = (70.0, 500.0)


def draw_light(rng: np.random.Generator, *, fair: bool = False) -> Light:
    """Day and night, sun, rain, snow and fog; if fair, a dry day."""
    weather = chosen(rng, _FAIR if fair else _WEATHER)
    dark = float(rng.uniform(0.3, 0.75) if weather == "dusk" else 1.0 if weather == "night" else 0.0)
    dull = weather in ("overcast", "rain", "fog", "snow")
    high = (0.03, 0.25) if weather in ("low sun", "dusk") else (0.25, 1.4)
    snow = float(rng.uniform(0.2, 1.0)) if weather == "snow" else 0.0
    rain = float(rng.uniform(0.1, 1.0)) if weather == "rain" else 0.0
    damp = 0.0 if fair else 0.3 if dull or dark else 0.08
    wet = max(rain, float(rng.uniform(0, 1)) if rng.random() < damp else 0.0)
    thick = float(np.exp(rng.uniform(np.log(0.008), np.log(0.04)))) if weather == "fog" else 0.0
    glare = weather == "low sun" or (dark and rng.random() < 0.5)
    return Light(
        sun_azimuth_rad=round(float(rng.uniform(-np.pi, np.pi)), 3),
        sun_elevation_rad=round(float(rng.uniform(*high)), 3),
        sun=round(float(rng.uniform(0.0, 0.2) if dull else rng.uniform(0.35, 0.9)), 3),
        haze_per_m=round(max(thick, float(np.exp(rng.uniform(np.log(0.0003), np.log(0.005))))), 5),
        clouds=round(float(rng.uniform(0.75, 1.0) if dull else rng.uniform(0.0, 0.8)), 3),
        exposure_drift=round(float(rng.uniform(0.0, 0.08)), 3),
        night=round(dark, 3),
        wet=round(wet, 3),
        rain=round(rain, 3),
        snow=round(snow, 3),
        glare=round(float(rng.uniform(0.1, 1.0)) if glare else 0.0, 3),
    )


def draw_relief(rng: np.random.Generator) -> Relief:
    """Every second street is level; the others rise by up to 8 in a hundred, hardly any by more."""
    if rng.random() < 0.5:
        return Relief()
    length = float(np.exp(rng.uniform(*np.log(_LENGTH_M))))
    steepest = float(rng.uniform(*_SLOPE))
    return Relief(height_m=round(steepest * length / STEEPEST, 3), length_m=round(length, 1))
