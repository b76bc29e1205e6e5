"""3D Gaussians."""

import math
from dataclasses import dataclass, fields, replace

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from dreamdrive.scene.camera import FARTHEST_M

SH_C0 = 0.28209479177387814
_ALWAYS_S = 1e9
"""Standard deviation of a life span that never ends."""
_LENGTHS = 1e-6, 1e6
"""Of quaternions; those of fits stay between 0.1 and 100."""
_MOST_LOG_SCALE, _BRIGHTEST, _LATEST_S = 40.0, 1e6, 1e10
"""Far beyond all that fits make, and so small that nothing computed of it overflows."""


@dataclass(frozen=True)
class Gaussians:
    """N Gaussians, parameterised as in 3DGS.

    Attributes:
        means: Centres (N, 3) in metres.
        quaternions: Rotations (N, 4), wxyz, not necessarily of unit length.
        log_scales: Natural logarithm of the standard deviations (N, 3) in metres.
        logit_opacities: Logit of the opacities (N,).
        sh: Spherical-harmonic colour (N, K, 3), K = 1, 4, 9 or 16; colour = SH(direction) + 0.5, at least 0.
        source_frame: Index of the frame each was seeded from (N,); children keep their parent's.
        features: Pixel-aligned features Z_ref (N, C), or None.
        lifespan: Time of full visibility and standard deviation in seconds (N, 2), or None: always visible.
            Opacity is multiplied by exp(-(t - centre)^2 / (2 deviation^2)).
        actor: Index of the actor each belongs to (N,), or None.
        velocity: Velocity at the centre of the life span in m/s (N, 3), of a ``Vibration`` or of a per-frame
            street; or None.
        filled: Which were put where no frame saw anything (N,), as a guess from around; None where none was.
    """

    means: Float[Tensor, "n 3"]
    quaternions: Float[Tensor, "n 4"]
    log_scales: Float[Tensor, "n 3"]
    logit_opacities: Float[Tensor, " n"]
    sh: Float[Tensor, "n k 3"]
    source_frame: Int[Tensor, " n"]
    features: Float[Tensor, "n c"] | None = None
    lifespan: Float[Tensor, "n 2"] | None = None
    actor: Int[Tensor, " n"] | None = None
    velocity: Float[Tensor, "n 3"] | None = None
    filled: Bool[Tensor, " n"] | None = None

    def __post_init__(self) -> None:
        if self.sh.shape[1] not in (1, 4, 9, 16):
            raise ValueError(f"sh: expected 1, 4, 9 or 16 coefficients a channel, got {self.sh.shape[1]}")

    def __len__(self) -> int:
        return len(self.means)

    def problem(self) -> str | None:
        """Why these can be of no scene: numbers that cannot be drawn; None where all can."""
        if not len(self):
            return None
        if not _within(self.means, -FARTHEST_M, FARTHEST_M):
            return f"Gaussians lie more than {FARTHEST_M:g} m away"
        if not _within(self.quaternions.norm(dim=1), *_LENGTHS):
            return "Gaussians have quaternions of length 0, or of no length that fits have"
        if not _within(self.log_scales, -math.inf, _MOST_LOG_SCALE):
            return f"Gaussians are larger than exp({_MOST_LOG_SCALE:g}) m"
        if not _within(self.sh, -_BRIGHTEST, _BRIGHTEST):
            return f"Gaussians have coefficients of colour beyond {_BRIGHTEST:g}"
        if self.lifespan is not None:
            centre_s, deviation_s = self.lifespan.unbind(-1)
            if not _within(centre_s, -_LATEST_S, _LATEST_S) or not _within(deviation_s, 0.0, _LATEST_S):
                return "Gaussians have life spans below 0, or at no time that recordings have"
        if self.velocity is not None and not _within(self.velocity, -FARTHEST_M, FARTHEST_M):
            return f"Gaussians are faster than {FARTHEST_M:g} m/s"
        return None

    @property
    def sh_degree(self) -> int:
        """Degree of the stored spherical harmonics, 0 to 3."""
        return {1: 0, 4: 1, 9: 2, 16: 3}[self.sh.shape[1]]

    def tensors(self) -> dict[str, Tensor]:
        """The present fields by name."""
        named = ((f.name, getattr(self, f.name)) for f in fields(self))
        return {name: value for name, value in named if value is not None}

    def select(self, index: Tensor) -> "Gaussians":
        """The Gaussians at a boolean mask (N,) or integer index (M,)."""
        # Its backward pass adds rows; that of value[index] sorts them first and takes ten times as long.
        rows = torch.nonzero(index).squeeze(1) if index.dtype == torch.bool else index
        return replace(self, **{name: value.index_select(0, rows) for name, value in self.tensors().items()})

    def to(self, device: torch.device) -> "Gaussians":
        """The same on a device."""
        return replace(self, **{name: value.to(device) for name, value in self.tensors().items()})

    def without_features(self) -> "Gaussians":
        """The same without Z_ref, which rendering has no use for and would be copied about with."""
        return replace(self, features=None)

    def alive_at(self, t_s: float) -> Int[Tensor, " m"]:
        """Rows that a life span leaves at least 1/255 of their opacity at ``t_s``: no other can be seen."""
        if self.lifespan is None:
            return torch.arange(len(self), device=self.means.device)
        centre_s, deviation_s = self.lifespan.unbind(-1)
        reach = math.sqrt(2 * math.log(255.0))
        return torch.nonzero((t_s - centre_s).abs() <= reach * deviation_s).squeeze(1)

    def faded_at(self, t_s: float) -> "Gaussians":
        """The same with the life spans turned into opacity at ``t_s``; the result has none.

        opacity' = opacity * exp(-e), e = (t - centre)^2 / (2 deviation^2), on logits without forming
        1 - opacity: logit' = logit - e - log(1 + exp(logit) (1 - exp(-e))).
        """
        if self.lifespan is None:
            return self
        centre_s, deviation_s = self.lifespan.unbind(-1)
        exponent = 0.5 * ((t_s - centre_s) / deviation_s.clamp(min=1e-6)) ** 2
        # exp(80) still fits float32; an opacity of logit 80 is 1 to the last bit.
        logit = self.logit_opacities.clamp(max=80.0)
        logit = logit - exponent - torch.log1p(logit.exp() * -torch.expm1(-exponent))
        return replace(self, logit_opacities=logit, lifespan=None)

    def moved_to(self, t_s: float) -> "Gaussians":
        """The same carried on by the velocities, if any, and faded; the result has neither."""
        if self.velocity is None:
            return self.faded_at(t_s)
        if self.lifespan is None:
            raise ValueError(
                "velocity: Gaussians with velocities need life spans, to tell when they are in place"
            )
        away_s = t_s - self.lifespan[:, :1]
        return replace(self, means=self.means + away_s * self.velocity, velocity=None).faded_at(t_s)

    def and_more(self, more: "Gaussians") -> "Gaussians":
        """These and others; what one side lacks it gets as nothing: no actor, not filled in, always there.

        Features are those of these, and 0 for the others; the fewer coefficients of colour are filled with 0.
        """
        coefficients = max(self.sh.shape[1], more.sh.shape[1])
        named = set(self.tensors()) | set(replace(more, features=None).tensors())
        made = []
        for part in (self, replace(more, features=None)):
            like, count = self.means, len(part)
            nothing = {
                "features": None if self.features is None else like.new_zeros(count, self.features.shape[1]),
                "lifespan": like.new_tensor([[0.0, _ALWAYS_S]]).repeat(count, 1),
                "actor": torch.full((count,), -1, dtype=torch.int64),
                "velocity": like.new_zeros(count, 3),
                "filled": torch.zeros(count, dtype=torch.bool),
            }
            given = {name: nothing[name] for name in named - set(part.tensors())}
            wide = torch.nn.functional.pad(part.sh, (0, 0, 0, coefficients - part.sh.shape[1]))
            made.append(replace(part, sh=wide, **given))
        return Gaussians.concatenate(*made)

    @staticmethod
    def concatenate(*parts: "Gaussians") -> "Gaussians":
        """Several sets as one; an optional field survives only if every part has it."""
        shared = set.intersection(*(set(p.tensors()) for p in parts))
        return Gaussians(**{name: torch.cat([getattr(p, name) for p in parts]) for name in shared})


def _within(values: Tensor, low: float, high: float) -> bool:
    """Whether all values are between two, which NaN never is."""
    least, most = torch.aminmax(values)
    return low <= float(least) and float(most) <= high
