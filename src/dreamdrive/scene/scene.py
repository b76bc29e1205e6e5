"""The product: a street over time as Gaussians."""

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from dreamdrive.scene.actor import Actor, Track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.log import OfLog
from dreamdrive.scene.sky import Sky
from dreamdrive.scene.trajectory import Trajectory


@runtime_checkable
class SceneMotion(Protocol):
    """What a scene asks of what moves its Gaussians; ``dreamdrive.motion`` holds all there are.

    ``kind`` is its name on disk; ``config`` is a dataclass that rebuilds it together with its ``state_dict``.
    """

    kind: ClassVar[str]
    config: Any

    def apply_at(self, gaussians: Gaussians, t_s: float) -> Gaussians:
        """The Gaussians as they are at ``t_s``; the result has no life spans left."""
        ...

    def check(self, gaussians: Gaussians) -> None:
        """Raise ``ValueError`` where these are not Gaussians that it can move."""
        ...

    def steered(self, actor: int, track: Track) -> "SceneMotion":
        """A copy in which an actor follows another track; ``ValueError`` where it knows no such actor."""
        ...

    def state_dict(self) -> dict[str, Tensor]:
        """What it has learned, by name."""
        ...


@dataclass(frozen=True)
class Provenance:
    """What a scene was made from; each may be unknown.

    Attributes:
        input: Name of the recording.
        source_index: Index of each view in it, in file or decode order.
        lens: Distortion of its camera, as ``data.lens.Lens`` writes it.
        up: Unit vector away from the road, in the world.
        scale: What metres rest on, in words.
        camera_height_m: Height of the first camera above the road.
        log: The drive of a data set, where it was made of one.
        prior: Name of the prior that drew or generated its frames; None where they were recorded.
    """

    input: str | None = None
    source_index: tuple[int, ...] | None = None
    lens: dict[str, Any] | None = None
    up: tuple[float, float, float] | None = None
    scale: str | None = None
    camera_height_m: float | None = None
    log: OfLog | None = None
    prior: str | None = None


@dataclass(frozen=True)
class Scene:
    """Static and dynamic Gaussians with everything needed to render any view at any time.

    World = the camera of the first frame (x right, y down, z forward), in metres.

    Attributes:
        static: What never moves; or, of a street that drifts, surfaces of single frames with life spans and
            velocities, see ``decompose.drifting``.
        dynamic: What moves, in its canonical place; may be empty.
        deformation: Where the dynamic Gaussians are over time; None leaves them in place.
        actors: The dynamic groups.
        sky: Background at infinity; None is black.
        exposure: The recording camera's colour over time; None is the identity.
        cameras: The recorded views (F,).
        times_s: Their times (F,).
        held_out: Which of them no fit has seen (F,).
        provenance: What the scene was made from.
        camera: Which camera of a rig each view is of (F,), the first one's being the drive; None where there
            is one camera only.
    """

    static: Gaussians
    dynamic: Gaussians
    deformation: SceneMotion | None
    actors: tuple[Actor, ...]
    sky: Sky | None
    exposure: Exposure | None
    cameras: tuple[Camera, ...]
    times_s: Float[np.ndarray, " f"]
    held_out: Bool[np.ndarray, " f"]
    provenance: Provenance = field(default_factory=Provenance)
    camera: Int[np.ndarray, " f"] | None = None

    def __post_init__(self) -> None:
        counts = [len(self.cameras), len(self.times_s), len(self.held_out)]
        counts += [] if self.camera is None else [len(self.camera)]
        if len(set(counts)) > 1:
            raise ValueError(
                f"scene: numbers of cameras, times, held-out marks (and rig indices) differ: {counts}"
            )

    @property
    def drifts(self) -> bool:
        """Whether the street moves as the picture does, as no path of the camera explains the frames."""
        return self.static.velocity is not None

    @property
    def trajectory(self) -> Trajectory:
        """The recorded drive, of the rig's first camera."""
        poses = [self.cameras[i].world_from_camera for i in self.front]
        return Trajectory(np.stack(poses), self.times_s[self.front])

    @property
    def front(self) -> Int[np.ndarray, " k"]:
        """Indices of the views of the rig's first camera."""
        if self.camera is None:
            return np.arange(len(self.cameras))
        return np.flatnonzero(self.camera == self.camera[0])

    def actor(self, id: int) -> Actor:
        """The actor of an id; ``ValueError`` names those there are."""
        for actor in self.actors:
            if actor.id == id:
                return actor
        raise ValueError(f"no actor {id}; there are {', '.join(str(a.id) for a in self.actors) or 'none'}")

    def without(self, id: int) -> "Scene":
        """The scene less one actor with all its Gaussians; the others keep their ids.

        Raises:
            ValueError: There is no such actor.
        """
        gone = self.actor(id)
        members = torch.zeros(len(self.dynamic), dtype=torch.bool)
        if self.dynamic.actor is not None:
            members = self.dynamic.actor == gone.id
        dynamic = self.dynamic.select(torch.nonzero(~members).squeeze(1))
        return replace(self, dynamic=dynamic, actors=tuple(a for a in self.actors if a.id != id))

    def with_standing(self, more: Gaussians) -> "Scene":
        """The scene with more of what never moves; the fewer coefficients of colour are filled with zeros."""
        coefficients = max(self.static.sh.shape[1], more.sh.shape[1])
        parts = [replace(part, sh=_widened(part.sh, coefficients)) for part in (self.static, more)]
        return replace(self, static=Gaussians.concatenate(*parts))

    def with_track(self, id: int, track: Track) -> "Scene":
        """The scene with an actor on another track, whose places are those of the same point of it.

        Before the first and after the last time of the track the actor goes on as there. Copies of its
        surface live as long as before: what no frame has seen stays empty.

        Raises:
            ValueError: There is no such actor, or what moves the scene knows no tracks.
        """
        actor = self.actor(id)
        if self.deformation is None:
            raise ValueError(f"nothing moves {actor.name}: the scene has no motion")
        steered = replace(actor, track=track, spread_m=None)
        return replace(
            self,
            deformation=self.deformation.steered(id, track),
            actors=tuple(steered if each.id == id else each for each in self.actors),
        )

    @torch.no_grad()
    def static_at(self, t_s: float) -> Gaussians:
        """The static Gaussians without features; the time matters only to a street that drifts."""
        return self.static.without_features().drifted_at(t_s)

    @torch.no_grad()
    def dynamic_at(self, t_s: float) -> Gaussians:
        """The dynamic Gaussians that live at ``t_s``, where they are then, without features."""
        living = self.dynamic.without_features().select(self.dynamic.alive_at(t_s))
        if self.deformation is None:
            return living.faded_at(t_s)
        return self.deformation.apply_at(living, t_s)

    def at(self, t_s: float) -> Gaussians:
        """All Gaussians at ``t_s``: the static ones, then the living dynamic ones; no gradients."""
        static = self.static_at(t_s)
        return Gaussians.concatenate(static, self.dynamic_at(t_s)) if len(self.dynamic) else static


def _widened(sh: Float[Tensor, "n k 3"], coefficients: int) -> Float[Tensor, "n m 3"]:
    return torch.nn.functional.pad(sh, (0, 0, 0, coefficients - sh.shape[1]))
