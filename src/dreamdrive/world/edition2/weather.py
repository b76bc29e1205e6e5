"""Weather, light and hills of the second edition."""

import numpy as np

from dreamdrive.scene.layout import Light, Relief
from dreamdrive.world.edition2.kinds import chosen
from dreamdrive.world.edition2.relief import STEEPEST

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
_SLOPE = (0.01, 0.08)
_LENGTH_M = (70.0, 500.0)


def draw_light(rng: np.random.Generator) -> Light:
    """Day and night, sun, rain, snow and fog."""
    weather = chosen(rng, _WEATHER)
    dark = float(rng.uniform(0.3, 0.75) if weather == "dusk" else 1.0 if weather == "night" else 0.0)
    dull = weather in ("overcast", "rain", "fog", "snow")
    high = (0.03, 0.25) if weather in ("low sun", "dusk") else (0.25, 1.4)
    snow = float(rng.uniform(0.2, 1.0)) if weather == "snow" else 0.0
    rain = float(rng.uniform(0.1, 1.0)) if weather == "rain" else 0.0
    wet = max(rain, float(rng.uniform(0, 1)) if rng.random() < (0.3 if dull or dark else 0.08) else 0.0)
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
    """Every second street is level; the others rise by 1 to 8 in a hundred where they are steepest."""
    if rng.random() < 0.5:
        return Relief()
    length = float(np.exp(rng.uniform(*np.log(_LENGTH_M))))
    steepest = float(rng.uniform(*_SLOPE))
    return Relief(height_m=round(steepest * length / STEEPEST, 3), length_m=round(length, 1))
