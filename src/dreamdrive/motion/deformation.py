"""Where the dynamic Gaussians are at a given time: rigid actor tracks plus a learned residual (eq. 11-12)."""

from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from dreamdrive.compute.device import in_core
from dreamdrive.motion.compiled_deformation import network_residual, posed
from dreamdrive.motion.protocol import Motion, MotionConfig, Start
from dreamdrive.motion.tracks import Tracks, key_weights, multiply_quaternions, rotate
from dreamdrive.scene.actor import Track
from dreamdrive.scene.gaussians import Gaussians


@dataclass(frozen=True)
class DeformationConfig(MotionConfig):
    """Shape of a deformation field; everything that is not learned or measured, so that JSON can rebuild it.

    Attributes:
        depth: Layers of the network (the paper's baseline: 8; 4 suits two cores).
        width: Units of each layer (the paper's baseline: 256; 64 suits two cores).
        position_frequencies: Octaves 2^0, 2^1, ... of the positional encoding of the normalised position.
        time_frequencies: Octaves of the encoding of the normalised time.
        actors: Actors with a rigid track; 0 for none.
        track_times: Key frames of each track; 0 for none.
        rigid: How many of the actors follow their track alone, with no residual: those of other scenes.
    """

    depth: int = 4
    width: int = 64
    position_frequencies: int = 10
    time_frequencies: int = 6
    actors: int = 0
    track_times: int = 0
    rigid: int = 0

    def __post_init__(self) -> None:
        if self.depth < 1 or self.width < 1 or min(self.position_frequencies, self.time_frequencies) < 0:
            raise ValueError(f"deformation: expected depth, width >= 1 and frequencies >= 0, got {self}")
        if self.actors < 0 or (self.actors == 0) != (self.track_times == 0):
            raise ValueError(f"deformation: {self.actors} actors with {self.track_times} key frames")
        if not 0 <= self.rigid <= self.actors:
            raise ValueError(f"deformation: {self.rigid} of {self.actors} actors are rigid")


@dataclass(frozen=True)
class Domain:
    """The space and time a deformation field is normalised by.

    Attributes:
        centre_m: Centre of the dynamic Gaussians (3,).
        radius_m: Distance from the centre that is mapped to 1.
        start_s: Time mapped to 0.
        end_s: Time mapped to 1.
        up: Unit axis of the actors' yaw (3,), in the world: the ground's normal.
    """

    centre_m: Float[np.ndarray, "3"]
    radius_m: float
    start_s: float
    end_s: float
    up: Float[np.ndarray, "3"]

    def __post_init__(self) -> None:
        if not (self.radius_m > 0 and self.end_s > self.start_s):
            raise ValueError(
                f"deformation: empty domain, radius {self.radius_m}, {self.start_s}..{self.end_s} s"
            )
        if abs(float(np.linalg.norm(self.up)) - 1) > 1e-4:
            raise ValueError(f"deformation: up must be a unit vector, got {self.up}")


@dataclass(frozen=True)
class Offsets:
    """What is added to each Gaussian at a time (eq. 12).

    Attributes:
        mean_m: To the mean (N, 3).
        quaternion: To the normalised quaternion (N, 4).
        log_scale: To the log-scale (N, 3).
    """

    mean_m: Float[Tensor, "n 3"]
    quaternion: Float[Tensor, "n 4"]
    log_scale: Float[Tensor, "n 3"]


def encode(values: Float[Tensor, "*n d"], frequencies: int) -> Float[Tensor, "*n e"]:
    """Positional encoding: the value, then sine and cosine of 2^0, 2^1, ... times it (no factor pi)."""
    octaves = 2.0 ** torch.arange(frequencies, dtype=values.dtype, device=values.device)
    angles = (values[..., None, :] * octaves[:, None]).flatten(-2)
    return torch.cat([values, angles.sin(), angles.cos()], dim=-1)


class DeformationField(Motion):
    """F_deform(x, t): offsets of mean, rotation and scale (eq. 11-12).

    A Gaussian of an actor follows the actor's rigid track; the network adds the residual. A Gaussian of no
    actor (index -1) has the residual alone, which is the paper's formulation.

    The heads start at zero, so the field starts as the identity (plus tracks). Scale offsets are added to
    log-scales (as drivestudio does; Deformable-3DGS adds them to the scales themselves, which can turn them
    negative). The network sees detached means: the canonical means get gradients through the splat only.

    Attributes:
        config: The shape, to rebuild the field from its ``state_dict``.
        track_translation: Learned key frames (A, T, 3).
        track_yaw_rad: Learned key frames (A, T).
    """

    kind = "network"
    config_type = DeformationConfig
    config: DeformationConfig
    centre_m: Tensor
    radius_m: Tensor
    time_range_s: Tensor
    up: Tensor
    track_times_s: Tensor
    track_pivot_m: Tensor
    track_rigid: Tensor | None

    def __init__(
        self, config: DeformationConfig, domain: Domain, tracks: Tracks | None = None, seed: int = 0
    ) -> None:
        super().__init__()
        shape = (0, 0) if tracks is None else tracks.yaw_rad.shape
        if shape != (config.actors, config.track_times):
            raise ValueError(f"deformation: tracks of shape {shape} for {config}")
        self.config = config
        self.register_buffer("centre_m", _tensor(domain.centre_m))
        self.register_buffer("radius_m", _tensor(domain.radius_m))
        # Double: seconds may be since the epoch, and a difference of two of them is used.
        self.register_buffer(
            "time_range_s", torch.tensor([domain.start_s, domain.end_s], dtype=torch.float64)
        )
        self.register_buffer("up", _tensor(domain.up))
        times_s = np.zeros(0) if tracks is None else tracks.times_s
        self.register_buffer("track_times_s", torch.tensor(times_s, dtype=torch.float64))
        self.register_buffer("track_pivot_m", _tensor(np.zeros((0, 3)) if tracks is None else tracks.pivot_m))
        rigid = torch.arange(config.actors) >= config.actors - config.rigid if config.rigid else None
        self.register_buffer("track_rigid", rigid)
        self.track_translation = nn.Parameter(
            _tensor(np.zeros((0, 0, 3)) if tracks is None else tracks.translation_m)
        )
        self.track_yaw_rad = nn.Parameter(_tensor(np.zeros((0, 0)) if tracks is None else tracks.yaw_rad))
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self._build_network()

    @classmethod
    def start(cls, config: DeformationConfig, given: Start) -> tuple["DeformationField", Gaussians]:
        """F_deform over the space of the dynamic Gaussians and the time of the clip."""
        means = given.dynamic.means.numpy().astype(np.float64)
        tracks, ground = given.tracks, given.geometry.ground
        centre = np.median(means, axis=0)
        radius = float(np.quantile(np.linalg.norm(means - centre, axis=1), 0.95))
        up = ground.normal_world if ground is not None else np.array([0.0, -1.0, 0.0])
        start_s, end_s = (float(given.clip.times_s[i]) for i in (0, -1))
        domain = Domain(centre, max(radius, 1e-3), start_s, end_s, up)
        if tracks is not None:
            config = replace(config, actors=len(tracks.pivot_m), track_times=len(tracks.times_s))
        return cls(config, domain, tracks, given.seed), given.dynamic

    @classmethod
    def blank(cls, config: DeformationConfig) -> "DeformationField":
        """One of this shape with any valid numbers in it."""
        actors, times = config.actors, config.track_times
        moves, turns = np.zeros((actors, times, 3)), np.zeros((actors, times))
        tracks = Tracks(np.arange(float(times)), moves, turns, np.zeros((actors, 3))) if actors else None
        return cls(config, Domain(np.zeros(3), 1.0, 0.0, 1.0, np.array([0.0, -1.0, 0.0])), tracks)

    def check(self, gaussians: Gaussians) -> None:
        """Raise ``ValueError`` where Gaussians belong to actors without a track."""
        actor, actors = gaussians.actor, self.config.actors
        if actors and actor is not None and not -1 <= int(actor.min()) <= int(actor.max()) < actors:
            raise ValueError(f"Gaussians belong to actors beyond the {actors} with a track")

    def _build_network(self) -> None:
        c = self.config
        inputs = 3 * (1 + 2 * c.position_frequencies) + 1 + 2 * c.time_frequencies
        self._skip = c.depth // 2 if c.depth >= 6 else None
        widths = [inputs] + [c.width + (inputs if i == self._skip else 0) for i in range(1, c.depth)]
        self.layers = nn.ModuleList(nn.Linear(width, c.width) for width in widths)
        self.head_mean = nn.Linear(c.width, 3)
        self.head_quaternion = nn.Linear(c.width, 4)
        self.head_log_scale = nn.Linear(c.width, 3)
        for head in (self.head_mean, self.head_quaternion, self.head_log_scale):
            nn.init.zeros_(head.weight)
            nn.init.zeros_(head.bias)

    def residual(self, means: Float[Tensor, "n 3"], t_s: float) -> Offsets:
        """What the network alone adds; ``means`` (N, 3) canonical, in metres."""
        position = (means.detach() - self.centre_m) / self.radius_m
        encoded = torch.cat(
            [
                encode(position, self.config.position_frequencies),
                self._time_code(means, t_s).expand(len(means), -1),
            ],
            dim=-1,
        )
        hidden = encoded
        for i, layer in enumerate(self.layers):
            hidden = torch.cat([encoded, hidden], dim=-1) if i == self._skip else hidden
            hidden = torch.relu(layer(hidden))
        return Offsets(self.head_mean(hidden), self.head_quaternion(hidden), self.head_log_scale(hidden))

    def _time_code(self, like: Tensor, t_s: float) -> Float[Tensor, " e"]:
        start_s, end_s = self.time_range_s.tolist()
        return encode(like.new_tensor([(t_s - start_s) / (end_s - start_s)]), self.config.time_frequencies)

    def pose(self, t_s: float) -> tuple[Float[Tensor, "a 3"], Float[Tensor, " a"]]:
        """Translation (A, 3) in metres and yaw (A,) in radians of every track at ``t_s``.

        A cubic through the key frames (Catmull-Rom); beyond them the velocity at the end continues.
        """
        weights = self.track_yaw_rad.new_tensor(key_weights(self.track_times_s.tolist(), t_s))
        translation = torch.einsum("atk,t->ak", self.track_translation, weights)
        return translation, self.track_yaw_rad @ weights

    def forward(
        self,
        means: Float[Tensor, "n 3"],
        quaternions: Float[Tensor, "n 4"],
        actor: Int[Tensor, " n"] | None,
        t_s: float,
    ) -> Offsets:
        """Offsets of N Gaussians at ``t_s``, to be added to means, normalised quaternions and log-scales.

        Args:
            means: Canonical centres in metres.
            quaternions: Canonical rotations, wxyz, of any length.
            actor: Index of the track each follows, -1 for none; None when nothing follows one.
            t_s: Time in seconds.
        """
        offsets = self.residual(means, t_s)
        if actor is None or self.config.actors == 0:
            return offsets
        if (bends := self._bends(actor)) is not None:
            offsets = Offsets(
                *(bends * each for each in (offsets.mean_m, offsets.quaternion, offsets.log_scale))
            )
        member = (actor >= 0).to(means.dtype)[:, None]
        index = actor.clamp(min=0)
        translation, yaw_rad = self.pose(t_s)
        arm = means - self.track_pivot_m[index]
        moved = rotate(arm, self.up, yaw_rad[index]) - arm + translation[index]
        unit = nn.functional.normalize(quaternions, dim=-1)
        turn = torch.cat([(0.5 * yaw_rad).cos()[:, None], (0.5 * yaw_rad).sin()[:, None] * self.up], dim=-1)[
            index
        ]
        return Offsets(
            offsets.mean_m + member * moved,
            offsets.quaternion + member * (multiply_quaternions(turn, unit) - unit),
            offsets.log_scale,
        )

    def apply_at(self, gaussians: Gaussians, t_s: float) -> Gaussians:
        """The Gaussians as they are at ``t_s``: moved, turned, scaled and faded; differentiable.

        float32 on the CPU goes through the compiled core, which has no gradient for life spans; all else goes
        through plain torch.
        """
        if len(gaussians) == 0:
            return gaussians.faded_at(t_s)
        if in_core(gaussians.means):
            return self._compiled_at(gaussians, t_s)
        offsets = self(gaussians.means, gaussians.quaternions, gaussians.actor, t_s)
        moved = replace(
            gaussians,
            means=gaussians.means + offsets.mean_m,
            quaternions=nn.functional.normalize(gaussians.quaternions, dim=-1) + offsets.quaternion,
            log_scales=gaussians.log_scales + offsets.log_scale,
        )
        return moved.faded_at(t_s)

    @torch.no_grad()
    def refined(self, actor: int, track: Track) -> Track:
        """See ``Motion``: the splines through the key frames, at the track's times."""
        poses = [self.pose(t_s) for t_s in track.times_s.tolist()]
        moved = torch.stack([translation[actor] for translation, _ in poses]).double().numpy(force=True)
        yaw_rad = torch.stack([yaw[actor] for _, yaw in poses]).double().numpy(force=True)
        return Track(track.times_s, self.track_pivot_m[actor].double().numpy(force=True) + moved, yaw_rad)

    @torch.no_grad()
    def steered(self, actor: int, track: Track) -> "DeformationField":
        """See ``Motion``; key frames keep their times."""
        self._check_known(actor)
        copy, keyed = deepcopy(self), track.at(self.track_times_s.numpy(force=True))
        pivot_m = self.track_pivot_m[actor].double().numpy(force=True)
        copy.track_translation[actor] = torch.from_numpy(keyed.positions_m - pivot_m).to(self.centre_m)
        copy.track_yaw_rad[actor] = torch.from_numpy(keyed.yaw_rad).to(self.centre_m)
        return copy

    @torch.no_grad()
    def shifted(self, actor: int, by_m: Float[np.ndarray, "3"], turn_rad: float) -> "DeformationField":
        """See ``Motion``."""
        self._check_known(actor)
        copy = deepcopy(self)
        copy.track_translation[actor] += torch.from_numpy(by_m).to(self.centre_m)
        copy.track_yaw_rad[actor] += turn_rad
        return copy

    @torch.no_grad()
    def copied(self, actor: int) -> "tuple[DeformationField, int]":
        """See ``Motion``."""
        self._check_known(actor)
        rigid = self.track_rigid is not None and bool(self.track_rigid[actor])
        return self._with_one_more(
            (self.track_translation[actor], self.track_yaw_rad[actor]), self.track_pivot_m[actor], rigid
        )

    @torch.no_grad()
    def adopted(self, track: Track) -> "tuple[DeformationField, int]":
        """See ``Motion``; without key frames so far, those are the times of the track."""
        base = self
        if not self.config.actors:
            base, count = deepcopy(self), len(track.times_s)
            base.track_times_s = torch.from_numpy(track.times_s).double()
            base.config = replace(self.config, track_times=count, actors=1)
            base.track_translation = nn.Parameter(self.centre_m.new_zeros(0, count, 3))
            base.track_yaw_rad = nn.Parameter(self.centre_m.new_zeros(0, count))
        keyed = track.at(base.track_times_s.numpy(force=True))
        rows = [torch.from_numpy(each).to(self.centre_m) for each in (keyed.positions_m, keyed.yaw_rad)]
        return base._with_one_more((rows[0], rows[1]), torch.zeros_like(self.centre_m), True)

    def _with_one_more(
        self, rows: tuple[Tensor, ...], pivot_m: Float[Tensor, "3"], rigid: bool
    ) -> "tuple[DeformationField, int]":
        """A copy with one actor more, on key frames of translation and yaw."""
        copy, new = deepcopy(self), len(self.track_pivot_m)
        copy.config = replace(self.config, actors=new + 1, rigid=self.config.rigid + rigid)
        copy.track_pivot_m = torch.cat([self.track_pivot_m, pivot_m[None]])
        if copy.config.rigid:
            known = torch.zeros(new, dtype=torch.bool) if self.track_rigid is None else self.track_rigid
            copy.track_rigid = torch.cat([known, torch.tensor([rigid])])
        for name, row in zip(("track_translation", "track_yaw_rad"), rows, strict=True):
            setattr(copy, name, nn.Parameter(torch.cat([getattr(self, name), row[None]])))
        return copy.requires_grad_(False), new

    def _check_known(self, actor: int) -> None:
        if not 0 <= actor < self.config.actors:
            raise ValueError(f"motion: no actor {actor} among the {self.config.actors} with a track")

    def _bends(self, actor: Int[Tensor, " n"]) -> Float[Tensor, "n 1"] | None:
        """1 for Gaussians that have a residual, 0 for those of rigid actors; None where all have one."""
        if self.track_rigid is None:
            return None
        bends = (actor < 0) | ~self.track_rigid[actor.clamp(min=0)]
        return bends.to(self.centre_m.dtype)[:, None]

    def groups(self) -> dict[str, list[nn.Parameter]]:
        """The network and the tracks, which learn at different rates."""
        tracks = [self.track_translation, self.track_yaw_rad]
        return {"network": [p for n, p in self.named_parameters() if "track_" not in n], "tracks": tracks}

    def _compiled_at(self, gaussians: Gaussians, t_s: float) -> Gaussians:
        if gaussians.lifespan is not None and gaussians.lifespan.requires_grad:
            raise ValueError("lifespan: the compiled core has no gradient for it; detach it or use float64")
        residual = network_residual(
            gaussians.means,
            self.centre_m,
            self.radius_m.item(),
            self._time_code(gaussians.means, t_s),
            self.config.position_frequencies,
            self.config.depth,
            self._skip,
            [tensor for layer in self._dense() for tensor in (layer.weight, layer.bias)],
        )
        if gaussians.actor is not None and (bends := self._bends(gaussians.actor)) is not None:
            residual = bends * residual
        means, quaternions, log_scales, logits = posed(
            (gaussians.means, gaussians.quaternions, gaussians.log_scales, gaussians.logit_opacities),
            residual,
            gaussians.lifespan,
            gaussians.actor if self.config.actors else None,
            self.pose(t_s),
            self.track_pivot_m,
            self.up,
            t_s,
        )
        return replace(
            gaussians,
            means=means,
            quaternions=quaternions,
            log_scales=log_scales,
            logit_opacities=logits,
            lifespan=None,
        )

    def _dense(self) -> list[nn.Linear]:
        """The hidden layers, then the heads."""
        return [*self.layers, self.head_mean, self.head_quaternion, self.head_log_scale]  # pyright: ignore[reportReturnType]


def _tensor(values: np.ndarray | float) -> Tensor:
    return torch.tensor(values, dtype=torch.float32)
