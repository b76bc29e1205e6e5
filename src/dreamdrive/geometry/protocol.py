"""What every way of getting geometry has in common."""

from pathlib import Path
from typing import Protocol

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry


class Reconstruct(Protocol):
    """The stage F_MVS (eq. 4): from a clip to posed cameras and dense depth."""

    def __call__(
        self, clip: Clip, *, camera_height_m: float | None = None, seed: int = 0, weights: Path | None = None
    ) -> Geometry:
        """Reconstruct a clip.

        Args:
            clip: The frames; what ``clip.known`` holds is used instead of being estimated. Held-out frames
                get a pose but no depth.
            camera_height_m: Height of the camera above the road, for the metric scale where nothing else
                gives it; None assumes 1.5 m.
            seed: Seed of everything random; same clip and seed, same geometry.
            weights: The network's file or folder; an ``InputError`` where there is no network, or none given.
        """
        ...
