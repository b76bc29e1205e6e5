"""The protocol of geometry backends."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from dreamdrive.geometry.options import GeometryOptions
from dreamdrive.models import Backend
from dreamdrive.progress import Work
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry


@runtime_checkable
class Reconstruct(Protocol):
    """The stage F_MVS (eq. 4): from a clip to posed cameras and dense depth."""

    def __call__(
        self, clip: Clip, options: GeometryOptions, *, seed: int = 0, work: Work = Work()
    ) -> Geometry:
        """Reconstruct a clip.

        Args:
            clip: Frames, with intrinsics, poses or depth where known. Held-out frames are posed, but their
                pixels give neither depth nor moving evidence.
            options: Those of the metric scale, and of its weights if it has a network, are for every method.
            seed: Seed of everything random; same clip and seed, same geometry.
            work: Told of each step by methods that can count them; keeps parts of the result.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class GeometryBackend(Backend):
    """A way of getting geometry, by its name for ``--geometry``."""

    reconstruct: Reconstruct
