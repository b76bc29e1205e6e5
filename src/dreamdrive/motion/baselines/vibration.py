"""Gaussians that swing about their place and live for a while: periodic vibration (PVG, Chen et al. 2023)."""

import math
from dataclasses import dataclass, replace

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.motion.protocol import Motion, MotionConfig, Start
from dreamdrive.scene.gaussians import Gaussians


@dataclass(frozen=True)
class VibrationConfig(MotionConfig):
    """What all Gaussians share. PVG counts time so that a frame of its drives at 10 Hz takes 0.02.

    Attributes:
        interval_s: Seconds between two frames; a fit puts those of the clip.
        cycle_frames: Length of the cycle, in intervals (PVG: 0.2, which is 10 frames).
        span_frames: Standard deviation of the life span at the start, in intervals (PVG: 0.3, 15 frames).
        shift_share: Share of the steps that are rendered from a neighbouring time (PVG: 0.5).
        shift_frames: How far off that time is at most, in intervals (PVG: 1.5).
        speed_weight: Weight of the mean speed, in s/m (PVG: 0.01 in its units of 10 m and 5 s at 10 Hz).
    """

    interval_s: float = 0.1
    cycle_frames: float = 10.0
    span_frames: float = 15.0
    shift_share: float = 0.5
    shift_frames: float = 1.5
    speed_weight: float = 0.005

    def __post_init__(self) -> None:
        if min(self.interval_s, self.cycle_frames, self.span_frames) <= 0:
            raise ValueError(f"vibration: expected interval, cycle and span above 0, got {self}")

    @property
    def cycle_s(self) -> float:
        """Length of the cycle in seconds."""
        return self.cycle_frames * self.interval_s


class Vibration(Motion):
    """Each Gaussian swings through its place with a velocity of its own, at the time it is seen best.

    With velocity v, life peak tau and life span beta of its own, and the length l of a cycle that all share,
    mean(t) = mean + l / (2 pi) sin(2 pi (t - tau) / l) v, opacity(t) = opacity exp(-(t - tau)^2 / 2 beta^2).

    Attributes:
        config: What all Gaussians share.
    """

    kind = "vibration"
    config_type = VibrationConfig
    config: VibrationConfig

    def __init__(self, config: VibrationConfig) -> None:
        super().__init__()
        self.config = config

    @classmethod
    def start(cls, config: VibrationConfig, given: Start) -> tuple["Vibration", Gaussians]:
        """Gaussians at rest that are seen best in the frame they come from, as in PVG from LiDAR points."""
        given.refuse_tracks(cls.kind)
        dynamic, config = given.dynamic, replace(config, interval_s=given.clip.interval_s)
        peak_s = torch.from_numpy(given.clip.times_s)[dynamic.source_frame].to(torch.float32)
        span_s = torch.full_like(peak_s, config.span_frames * config.interval_s)
        life = torch.stack([peak_s, span_s], dim=1)
        return cls(config), replace(dynamic, velocity=torch.zeros_like(dynamic.means), lifespan=life)

    @classmethod
    def blank(cls, config: VibrationConfig) -> "Vibration":
        """One of this shape; it holds no numbers of its own."""
        return cls(config)

    def check(self, gaussians: Gaussians) -> None:
        """Raise ``ValueError`` where they have no velocities or no life spans."""
        _moving(gaussians)

    def apply_at(self, gaussians: Gaussians, t_s: float) -> Gaussians:
        """The Gaussians as they are at ``t_s``: moved and faded; differentiable.

        Raises:
            ValueError: They have no velocities or no life spans.
        """
        return self._shifted_at(gaussians, t_s, 0.0)

    def training_at(self, gaussians: Gaussians, t_s: float, generator: torch.Generator) -> Gaussians:
        """Now and then what a neighbouring time predicts for ``t_s`` (PVG's self-supervised smoothing).

        That is the state at the other time, carried on by the mean velocities: neighbours in time then have
        to agree on where things go.
        """
        c = self.config
        draw, place = torch.rand(2, generator=generator, device=generator.device).tolist()
        shift_s = (2 * place - 1) * c.shift_frames * c.interval_s if draw < c.shift_share else 0.0
        return self._shifted_at(gaussians, t_s, shift_s)

    def mean_velocity(self, gaussians: Gaussians) -> Float[Tensor, "n 3"]:
        """Velocity averaged over the life span in m/s, v exp(-beta / (2 l)) (PVG): what lives long stays."""
        velocity, lifespan = _moving(gaussians)
        return velocity * torch.exp(-lifespan[:, 1:] / (2 * self.config.cycle_s))

    def penalty(self, canonical: Gaussians, moved: Gaussians) -> Float[Tensor, ""] | None:
        """Mean absolute component of the mean velocities of the living.

        PVG renders them and takes the mean over the picture; over Gaussians it costs nothing.
        """
        if len(canonical) == 0:
            return None
        return self.config.speed_weight * self.mean_velocity(canonical).abs().mean()

    def _shifted_at(self, gaussians: Gaussians, t_s: float, shift_s: float) -> Gaussians:
        """The state at ``t_s - shift_s``, carried on for ``shift_s``."""
        velocity, lifespan = _moving(gaussians)
        rate = 2 * math.pi / self.config.cycle_s
        swing_s = torch.sin(rate * (t_s - shift_s - lifespan[:, :1])) / rate
        means = gaussians.means + swing_s * velocity
        if shift_s:
            means = means + shift_s * self.mean_velocity(gaussians)
        return replace(gaussians, means=means, velocity=None).faded_at(t_s - shift_s)


def _moving(gaussians: Gaussians) -> tuple[Float[Tensor, "n 3"], Float[Tensor, "n 2"]]:
    if gaussians.velocity is None or gaussians.lifespan is None:
        raise ValueError("vibration: the Gaussians have no velocity or no life span")
    return gaussians.velocity, gaussians.lifespan
