"""The protocol of representations of motion."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.motion.tracks import Tracks
from dreamdrive.scene.actor import Track
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry


@dataclass(frozen=True)
class MotionConfig:
    """Everything of a motion that is neither learned nor measured; its type says which motion it is."""

    @classmethod
    def sized(cls, width: int) -> "MotionConfig":
        """The defaults, with networks of ``width`` units a layer where there are any."""
        return cls(**{f.name: width for f in fields(cls) if f.name == "width"})


@dataclass(frozen=True)
class Start:
    """What a motion starts from.

    Attributes:
        clip: The frames' times.
        geometry: The up axis.
        dynamic: What moves; at least one.
        tracks: Motion of the actors, or None; a deformation field alone takes them.
        seed: Of initial weights.
    """

    clip: Clip
    geometry: Geometry
    dynamic: Gaussians
    tracks: Tracks | None
    seed: int

    def refuse_tracks(self, kind: str) -> None:
        """Raise ``ValueError`` where there are any, for a motion that knows none."""
        if self.tracks is not None:
            raise ValueError(f"motion: {kind} knows no tracks of actors")


class Motion(nn.Module, ABC):
    """Where the dynamic Gaussians are over time.

    Attributes:
        kind: Its name in ``MOTIONS`` and on disk.
        config_type: Class of ``config``.
        config: Rebuilds it together with its ``state_dict``.
    """

    kind: ClassVar[str]
    config_type: ClassVar[type[MotionConfig]]
    config: Any

    @classmethod
    @abstractmethod
    def start(cls, config: Any, given: Start) -> tuple["Motion", Gaussians]:
        """What moves the Gaussians, before any step, and they themselves with what it needs of each.

        What is measured is filled into ``config``.

        Raises:
            ValueError: There are tracks, and it knows none.
        """

    @classmethod
    @abstractmethod
    def blank(cls, config: Any) -> "Motion":
        """One of this shape with any valid numbers in it."""

    @abstractmethod
    def apply_at(self, gaussians: Gaussians, t_s: float) -> Gaussians:
        """The Gaussians as they are at ``t_s``, differentiable; the result has no life spans left."""

    def _apply(self, fn: Callable[[Tensor], Tensor], recurse: bool = True) -> "Motion":
        """Times stay on the CPU whatever else moves: a step asks for each of them, and would wait for it."""
        times = {name: values for name, values in self._buffers.items() if name.endswith("_s")}
        super()._apply(fn, recurse)
        self._buffers.update(times)
        return self

    def check(self, gaussians: Gaussians) -> None:
        """Raise ``ValueError`` where these are not Gaussians that it can move."""

    def groups(self) -> dict[str, list[nn.Parameter]]:
        """What is learned, by the name of its step size in ``fit.FitOptions``; see ``fit.trainer.RATES``."""
        return {"network": list(self.parameters())}

    def training_at(self, gaussians: Gaussians, t_s: float, generator: torch.Generator) -> Gaussians:
        """What a step of the fit renders at ``t_s``; the same as a scene unless a method says otherwise."""
        return self.apply_at(gaussians, t_s)

    def refined(self, actor: int, track: Track) -> Track:
        """The track that an actor has now, at the times of the one that it started with."""
        return track

    def on(self, device: torch.device) -> "Motion":
        """A copy on a device."""
        return deepcopy(self).to(device)

    def steered(self, actor: int, track: Track) -> "Motion":
        """A copy in which an actor follows another track.

        Raises:
            ValueError: It knows no tracks, or none of this actor.
        """
        raise ValueError(f"motion: {self.kind} knows no tracks of actors")

    def copied(self, actor: int) -> "tuple[Motion, int]":
        """A copy with one actor more that moves as this one does, and its index.

        Raises:
            ValueError: It knows no tracks, or none of this actor.
        """
        raise ValueError(f"motion: {self.kind} knows no tracks of actors")

    def shifted(self, actor: int, by_m: Float[np.ndarray, "3"], turn_rad: float) -> "Motion":
        """A copy in which an actor is elsewhere and turned, on a path of the same shape.

        Raises:
            ValueError: It knows no tracks, or none of this actor.
        """
        raise ValueError(f"motion: {self.kind} knows no tracks of actors")

    def adopted(self, track: Track) -> "tuple[Motion, int]":
        """A copy with one actor more, which follows a track and is rigid, and its index.

        In its canonical place the middle of its bottom is the origin.

        Raises:
            ValueError: It knows no tracks.
        """
        raise ValueError(f"motion: {self.kind} knows no tracks of actors")

    def penalty(self, canonical: Gaussians, moved: Gaussians) -> Float[Tensor, ""] | None:
        """A term to add to the loss of a step, weighted; None for none.

        Args:
            canonical: What went into ``training_at``.
            moved: What came out.
        """
        return None
