"""The light of a street: sun, sky and haze."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from streetworld.engine.materials import sampled


@dataclass(frozen=True)
class SkyLight:
    """The upper half of all directions, and what comes from there. Colours are linear, white about 1.

    The panorama has rows from zenith to horizon, its columns are a turn from x towards y. Sunlight falls on a
    surface that faces the sun, skylight on one that faces up. Of the light ``haze_per_m`` is lost along each
    metre, and the colour of the haze seen instead.
    """

    panorama: Float[np.ndarray, "h w 3"]
    towards_sun: Float[np.ndarray, "3"]
    sunlight: Float[np.ndarray, "3"]
    skylight: Float[np.ndarray, "3"]
    haze_per_m: float
    haze: Float[np.ndarray, "3"]

    def colour(self, directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """What is seen along some directions; those below the horizon see the haze there."""
        turn = np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi) % 1.0
        up = np.arctan2(directions[:, 2], np.hypot(directions[:, 0], directions[:, 1])) / (np.pi / 2)
        height, width = self.panorama.shape[:2]
        place = np.stack([turn * (width - 1), (1 - np.clip(up, 0, 1)) * (height - 1)], axis=-1)
        return sampled(self.panorama, place)
