"""What every way of getting geometry has in common."""

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Protocol, runtime_checkable

from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry


@runtime_checkable
class Reconstruct(Protocol):
    """The stage F_MVS (eq. 4): from a clip to posed cameras and dense depth."""

    def __call__(
        self, clip: Clip, *, camera_height_m: float | None = None, seed: int = 0, weights: Path | None = None
    ) -> Geometry:
        """Reconstruct a clip.

        Args:
            clip: Frames, with intrinsics, poses or depth where known. Held-out frames are posed, but their
                pixels give neither depth nor moving evidence.
            camera_height_m: Height of the camera above the road, for the metric scale where nothing else
                gives it; None assumes 1.5 m.
            seed: Seed of everything random; same clip and seed, same geometry.
            weights: The network's file or folder, for backends that have one.
        """
        ...


@dataclass(frozen=True)
class Backend:
    """A way of getting geometry, and what it takes.

    Attributes:
        name: For ``--geometry``.
        reconstruct: The way itself.
        about: What it is, for people.
        licence: Of the code that is installed for it, and of the weights.
        memory: What it needs beyond the clip, in words.
        weights: Which weights it takes; None without a network.
        package: The module that has to be importable; None where nothing more is installed.
        install: How to get that package.
    """

    name: str
    reconstruct: Reconstruct
    about: str
    licence: str
    memory: str
    weights: str | None = None
    package: str | None = None
    install: str | None = None

    def missing_package(self) -> str | None:
        """What to install, in words; None where nothing is missing."""
        if self.package is None or find_spec(self.package) is not None:
            return None
        return f"the package {self.package} is missing: {self.install}"

    def check(self, weights: Path | None) -> None:
        """Whether it could start.

        Raises:
            InputError: Weights or the package are missing, or weights are given to what has no network.
        """
        if self.weights is None:
            if weights is not None:
                raise InputError(f"geometry {self.name} has no network and takes no weights; got {weights}")
            return
        if weights is None:
            raise InputError(
                f"geometry {self.name} needs --weights PATH, {self.weights} (licence: {self.licence})"
            )
        if (missing := self.missing_package()) is not None:
            raise InputError(f"geometry {self.name}: {missing}")
