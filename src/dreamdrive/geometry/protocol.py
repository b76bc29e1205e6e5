"""What every way of getting geometry has in common."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from dreamdrive.errors import InputError
from dreamdrive.models import Backend
from dreamdrive.progress import Work
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry


@dataclass(frozen=True)
class GeometryOptions:
    """How cameras and depth are found.

    Attributes:
        method: Name of the way.
        weights: The network's file or folder, for methods that have one.
        camera_height_m: Height of the camera above the road, which fixes the metric scale where nothing
            better does; None assumes 1.5 m.
        refine_poses: Whether known poses give the length of the path only, see ``cameras.refine``.
    """

    method: str = "classical"
    weights: Path | None = None
    camera_height_m: float | None = None
    refine_poses: bool = False

    def __post_init__(self) -> None:
        height_m = self.camera_height_m
        if height_m is not None and not 0 < height_m < float("inf"):
            raise InputError(f"--camera-height {height_m:g}: expected metres above the road, such as 1.5")


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
        work: Work = Work(),
    ) -> Geometry:
        """Reconstruct a clip.

        Args:
            clip: Frames, with intrinsics, poses or depth where known. Held-out frames are posed, but their
                pixels give neither depth nor moving evidence.
            camera_height_m: Height of the camera above the road, for the metric scale where nothing else
                gives it; None assumes 1.5 m.
            seed: Seed of everything random; same clip and seed, same geometry.
            weights: The network's file or folder, for backends that have one.
            work: Told of each step by backends that can count them; keeps parts of the result.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class GeometryBackend(Backend):
    """A way of getting geometry, by its name for ``--geometry``."""

    reconstruct: Reconstruct
