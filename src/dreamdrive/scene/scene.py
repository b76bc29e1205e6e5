"""The product: a street over time as Gaussians."""

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
import torch
from jaxtyping import Bool, Float, Float16, Int, UInt8
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.registry import FRAMES, loaded, shown
from dreamdrive.scene.actor import Actor, Track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.sky import Sky
from dreamdrive.scene.street.log import OfLog
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

    def copied(self, actor: int) -> "tuple[SceneMotion, int]":
        """A copy with one actor more that moves as this one, and its index; ``ValueError`` likewise."""
        ...

    def shifted(self, actor: int, by_m: Float[np.ndarray, "3"], turn_rad: float) -> "SceneMotion":
        """A copy in which an actor is elsewhere and turned, its path of the same shape; likewise."""
        ...

    def adopted(self, track: Track) -> "tuple[SceneMotion, int]":
        """A copy with a rigid actor more, canonically at the origin, on a track, and its index; likewise."""
        ...

    def on(self, device: torch.device) -> "SceneMotion":
        """A copy on a device."""
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
        static: What never moves; or, of a per-frame street, surfaces of single frames with life spans and
            velocities, see ``decompose.per_frame``.
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
        residual: How far each view is off its frame, see ``vision.residual`` (F, H // 8, W // 8); None where
            no frames were compared.
        frames: The recorded frames as JPEG, a frame a view, empty where it is held out; None where none were
            kept, or where the scene was changed, so that they show something else.
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
    residual: Float16[np.ndarray, "f bh bw"] | None = None
    frames: tuple[bytes, ...] | None = None

    def __post_init__(self) -> None:
        counts = [len(self.cameras), len(self.times_s), len(self.held_out)]
        counts += [len(each) for each in (self.camera, self.frames) if each is not None]
        if len(set(counts)) > 1:
            raise ValueError(
                f"scene: numbers of cameras, times, held-out marks (and rig indices, frames) differ: {counts}"
            )

    def on(self, device: torch.device | str) -> "Scene":
        """The scene with all its tensors on a device, where it is rendered then."""
        there = torch.device(device)
        if self.static.means.device == there:
            return self
        return replace(
            self,
            static=self.static.to(there),
            dynamic=self.dynamic.to(there),
            deformation=None if self.deformation is None else self.deformation.on(there),
            sky=None if self.sky is None else self.sky.on(there),
            exposure=None if self.exposure is None else self.exposure.on(there),
        )

    @property
    def moves_per_frame(self) -> bool:
        """Whether the street moves as the picture does, as no path of the camera explains the frames."""
        return self.static.velocity is not None

    @property
    def up(self) -> Float[np.ndarray, "3"]:
        """Unit vector away from the road; that of a level first camera where nothing tells."""
        return np.array(self.provenance.up or (0.0, -1.0, 0.0))

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

    def of_rig(self, view: int) -> int:
        """Which camera of the rig a view is of; 0 where there is one camera only."""
        return 0 if self.camera is None else int(self.camera[view])

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
        dynamic = self.dynamic.select(torch.nonzero(~self._members(self.actor(id))).squeeze(1))
        actors = tuple(each for each in self.actors if each.id != id)
        return replace(self, dynamic=dynamic, actors=actors, frames=None)

    def moved(self, id: int, ahead_m: float = 0.0, left_m: float = 0.0) -> "Scene":
        """The scene with an actor's whole track elsewhere: so far ahead and to the left of it as it points.

        Raises:
            ValueError: See ``with_track``; or nothing tells where it points.
        """
        actor, up = self.actor(id), self.up
        ahead = actor.ahead(up)
        if ahead is None:
            raise ValueError(f"nothing tells where {actor.name} points: it has no box and hardly moves")
        return self._shifted(actor, ahead_m * ahead + left_m * np.cross(up, ahead), 0.0)

    def turned(self, id: int, degrees: float) -> "Scene":
        """The scene with an actor turned to the left on its track; ``ValueError``: see ``with_track``."""
        return self._shifted(self.actor(id), np.zeros(3), float(np.deg2rad(degrees)))

    def delayed(self, id: int, seconds: float) -> "Scene":
        """The scene with an actor that comes later, or earlier; ``ValueError``: see ``with_track``."""
        actor = self.actor(id)
        return self._retimed(actor, replace(actor.track, times_s=actor.track.times_s + seconds), seconds, 1.0)

    def with_speed(self, id: int, factor: float) -> "Scene":
        """The scene with an actor so many times as fast from its first time on.

        Raises:
            ValueError: See ``with_track``; or the factor is not above 0.
        """
        if not 0 < factor < float("inf"):
            raise ValueError(f"speed {factor:g}: expected a factor above 0")
        actor = self.actor(id)
        first_s = actor.track.first_s
        times_s = first_s + (actor.track.times_s - first_s) / factor
        return self._retimed(actor, replace(actor.track, times_s=times_s), 0.0, 1 / factor)

    def copied(self, id: int, ahead_m: float = 0.0, left_m: float = 0.0) -> "Scene":
        """The scene with a second one of an actor, the last of its actors, elsewhere as ``moved`` has it.

        Raises:
            ValueError: See ``moved``.
        """
        actor = self.actor(id)
        if self.deformation is None:
            raise ValueError(f"nothing moves {actor.name}: the scene has no motion")
        motion, new = self.deformation.copied(id)
        twin = self.dynamic.select(torch.nonzero(self._members(actor)).squeeze(1))
        twin = replace(twin, actor=torch.full((len(twin),), new, dtype=torch.int64))
        named = replace(actor, id=new, name=f"actor {new}")
        both = replace(
            self,
            deformation=motion,
            dynamic=Gaussians.concatenate(self.dynamic, twin),
            actors=(*self.actors, named),
            frames=None,
        )
        return both.moved(new, ahead_m, left_m)

    def recoloured(self, id: int, rgb: tuple[float, float, float]) -> "Scene":
        """The scene with an actor in one colour, RGB in [0, 1]; what was dark stays darker than the rest.

        Raises:
            ValueError: There is no such actor, or the colour is none.
        """
        if not all(0 <= value <= 1 for value in rgb):
            raise ValueError(f"colour {rgb}: expected three numbers from 0 to 1")
        members = self._members(self.actor(id))
        sh = self.dynamic.sh.clone()
        own = sh[members]
        grey = own.mean(dim=2)
        light = (grey[:, 0] * SH_C0 + 0.5).clamp(min=0)
        scale = sh.new_tensor(rgb) / (light.median().clamp(min=1e-3) if len(own) else 1.0)
        painted = grey[..., None] * scale
        painted[:, 0] = ((light[:, None] * scale).clamp(max=1) - 0.5) / SH_C0
        sh[members] = painted
        return replace(self, dynamic=replace(self.dynamic, sh=sh), frames=None)

    def with_standing(self, more: Gaussians) -> "Scene":
        """The scene with more of what never moves; the fewer coefficients of colour are filled with zeros."""
        return replace(self, static=self.static.and_more(more))

    def without_filled(self) -> "Scene":
        """The scene without what was put where no frame saw anything."""
        filled = self.static.filled
        return self if filled is None else replace(self, static=self.static.select(~filled))

    def inserted(self, actor: Actor, gaussians: Gaussians, motion: SceneMotion) -> "Scene":
        """The scene with an actor more, the last of its actors, and what moves all of them.

        Args:
            actor: Its id is the index that the motion has for it.
            gaussians: Those of the actor, in its canonical place; ``edit.inserted`` makes them.
            motion: That of the scene with one actor more, see ``SceneMotion.adopted``.

        Raises:
            ValueError: There is an actor of this id, or a Gaussian is of another one.
        """
        own = gaussians.actor is not None and bool((gaussians.actor == actor.id).all())
        if any(each.id == actor.id for each in self.actors) or not own:
            raise ValueError(f"actor {actor.id} is known already, or Gaussians are of another one")
        return replace(
            self,
            dynamic=self.dynamic.and_more(gaussians),
            deformation=motion,
            actors=(*self.actors, actor),
            frames=None,
        )

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
            frames=None,
        )

    def _members(self, actor: Actor) -> Bool[Tensor, " n"]:
        """Which of the dynamic Gaussians are of an actor."""
        if self.dynamic.actor is None:
            return torch.zeros(len(self.dynamic), dtype=torch.bool)
        return self.dynamic.actor == actor.id

    def _shifted(self, actor: Actor, by_m: Float[np.ndarray, "3"], turn_rad: float) -> "Scene":
        """An actor elsewhere and turned; between its points its path is as it was."""
        if self.deformation is None:
            raise ValueError(f"nothing moves {actor.name}: the scene has no motion")
        path = actor.track
        track = Track(path.times_s, path.positions_m + by_m, path.yaw_rad + turn_rad)
        return replace(
            self,
            deformation=self.deformation.shifted(actor.id, by_m, turn_rad),
            actors=tuple(replace(a, track=track) if a.id == actor.id else a for a in self.actors),
            frames=None,
        )

    def _retimed(self, actor: Actor, track: Track, later_s: float, slower: float) -> "Scene":
        """An actor on a track of as many points; its surface lives later and longer, from its first time."""
        if (later_s, slower) == (0.0, 1.0):
            return self
        steered = self.with_track(actor.id, track)
        kept = tuple(replace(a, spread_m=actor.spread_m) if a.id == actor.id else a for a in steered.actors)
        if self.dynamic.lifespan is None:
            return replace(steered, actors=kept)
        lifespan, members = self.dynamic.lifespan.clone(), self._members(actor)
        first_s = actor.track.first_s
        centre_s, deviation_s = lifespan[members].unbind(-1)
        lifespan[members] = torch.stack(
            [first_s + (centre_s - first_s) * slower + later_s, deviation_s * slower], dim=1
        )
        return replace(steered, actors=kept, dynamic=replace(self.dynamic, lifespan=lifespan))

    def render(
        self, trajectory: Trajectory, size: tuple[int, int] | None = None
    ) -> UInt8[np.ndarray, "t h w 3"]:
        """Frames (T, H, W, 3) along a path, by the first recorded camera: RGB as bytes, a frame a pose.

        ``size`` is width and height in pixels, that of the recording without it; the horizontal field of view
        stays. ``dreamdrive.render_scene`` gives depth and more of one view.
        """
        return loaded(FRAMES)(self, trajectory, size)

    def _repr_html_(self) -> str:
        return shown(self)

    @torch.no_grad()
    def static_at(self, t_s: float) -> Gaussians:
        """The static Gaussians without features; the time matters only to a per-frame street."""
        return self.static.without_features().moved_to(t_s)

    @torch.no_grad()
    def dynamic_at(self, t_s: float) -> Gaussians:
        """The dynamic Gaussians that live at ``t_s``, where they are then, without features."""
        living = self.dynamic.without_features().select(self.dynamic.alive_at(t_s))
        return self.moved_at(living, t_s)

    def moved_at(self, gaussians: Gaussians, t_s: float) -> Gaussians:
        """Some of the dynamic Gaussians as they are at ``t_s``; the result has no life spans left.

        Raises:
            InputError: What moves the scene leads to numbers that cannot be drawn.
        """
        if self.deformation is None:
            return gaussians.faded_at(t_s)
        moved = self.deformation.apply_at(gaussians, t_s)
        if problem := moved.problem():
            raise InputError(f"the scene's motion cannot be used: at {t_s:g} s {problem}; generate it again")
        return moved

    def at(self, t_s: float) -> Gaussians:
        """All Gaussians at ``t_s``: the static ones, then the living dynamic ones; no gradients."""
        static = self.static_at(t_s)
        return Gaussians.concatenate(static, self.dynamic_at(t_s)) if len(self.dynamic) else static
