"""What every way of getting geometry has in common."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from dreamdrive.models import Backend
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry


@runtime_checkable
class Reconstruct(Protocol):
    """The stage F_MVS (eq. 4): from a clip to posed cameras and dense depth."""

    def __call__(
        self,
        clip: Clip,
        *,
        camera_height_m: float | None = None,
        seed: int = 0,
        weights: Path | None = None,
        progress: Progress = silent,
    ) -> Geometry:
        """Reconstruct a clip.

        Args:
            clip: Frames, with intrinsics, poses or depth where known. Held-out frames are posed, but their
                pixels give neither depth nor moving evidence.
            camera_height_m: Height of the camera above the road, for the metric scale where nothing else
                gives it; None assumes 1.5 m.
            seed: Seed of everything random; same clip and seed, same geometry.
            weights: The network's file or folder, for backends that have one.
            progress: Told of each step, by backends that can count them.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class GeometryBackend(Backend):
    """A way of getting geometry, by its name for ``--geometry``.

    Attributes:
        reconstruct: The way itself.
    """

    reconstruct: Reconstruct
