"""A factorised 4D feature field that moves Gaussians: six planes a level and a small decoder.

The planes are those of HexPlane (Cao and Johnson 2023) and K-Planes (Fridovich-Keil et al. 2023), the decoder
and what it moves those of S3Gaussian (Huang et al. 2024), which extends 4D-GS (Wu et al. 2024) to streets.
"""

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.compute.device import in_core
from dreamdrive.motion.baselines.compiled_hexplane import dense_network, plane_features, steepness
from dreamdrive.motion.protocol import Motion, MotionConfig, Start
from dreamdrive.scene.gaussians import Gaussians

# Axes of the planes without time: xy, xz, yz; those with it are xt, yt, zt.
_SPACE = ((0, 1), (0, 2), (1, 2))
# Share of the Gaussians beyond each side of a fit's box: a few are at the far end of the street, and nodes
# that reach out to them are missing nearby.
OUTSIDE = 0.01


@dataclass(frozen=True)
class HexPlaneConfig(MotionConfig):
    """Shape of a field and weights of its penalties; everything that is not learned or measured.

    Attributes:
        width: Units of the decoder's layers (S3Gaussian and 4D-GS: 64).
        features: Channels of each plane (4D-GS on DyNeRF: 16; S3Gaussian: 32).
        resolution: Nodes along each axis of space of the coarsest level (both: 64).
        levels: Levels, each twice as fine in space as the one before (4D-GS: 2; S3Gaussian: 4).
        times: Nodes along time; a fit puts half the number of frames (4D-GS's advice; S3Gaussian: 25 for 50).
        coefficients: Spherical-harmonic coefficients a channel of the Gaussians; a fit puts theirs.
        plane_weight: Weight of the total variation of the planes without time (both: 1e-4).
        time_weight: Weight of the planes' curvature along time (both: 0.01).
        unity_weight: Weight of what separates the planes with time from 1 (both: 1e-4).
        offset_weight: Weight of the mean offset of positions, in 1/m, and of colours (S3Gaussian: 1e-3).
    """

    width: int = 64
    features: int = 16
    resolution: int = 64
    levels: int = 2
    times: int = 2
    coefficients: int = 4
    plane_weight: float = 1e-4
    time_weight: float = 0.01
    unity_weight: float = 1e-4
    offset_weight: float = 1e-3

    def __post_init__(self) -> None:
        if min(self.width, self.features, self.levels) < 1 or min(self.resolution, self.times) < 2:
            raise ValueError(
                f"hexplane: expected width, features, levels >= 1 and two nodes an axis, got {self}"
            )


@dataclass(frozen=True)
class Bounds:
    """The box of space and time that the planes cover; beyond it their border continues.

    Attributes:
        low_m: Least corner (3,).
        high_m: Greatest corner (3,).
        start_s: First time.
        end_s: Last time.
    """

    low_m: Float[np.ndarray, "3"]
    high_m: Float[np.ndarray, "3"]
    start_s: float
    end_s: float

    def __post_init__(self) -> None:
        if not ((self.high_m > self.low_m).all() and self.end_s > self.start_s):
            raise ValueError(f"hexplane: an empty box: {self}")


class HexPlaneField(Motion):
    """Offsets of means and colours from features of space and time.

    The feature of a Gaussian is, level by level, the product over six planes of what each holds at the
    projection of its canonical mean and the time, bilinear between nodes; the levels are
    concatenated. A linear layer and, for each head, two more decode it. As published, S3Gaussian moves means
    and spherical harmonics and leaves rotations and scales alone. Planes with time start at 1, so that space
    alone speaks at first; the others start uniform in [0.1, 0.5].

    As in ``DeformationField`` the last layers start at zero and the canonical means get gradients through the
    splat only (4D-GS starts at random behind a static stage, and lets the planes pull at the means).

    Attributes:
        config: The shape, to rebuild the field from its ``state_dict``.
        space: Planes xy, xz, yz of each level, (3, C, R, R), the first named axis last.
        time: Planes xt, yt, zt of each level, (3, C, T, R), space last.
    """

    kind = "hexplane"
    config_type = HexPlaneConfig
    config: HexPlaneConfig
    low_m: Tensor
    high_m: Tensor
    time_range_s: Tensor

    def __init__(self, config: HexPlaneConfig, bounds: Bounds, seed: int = 0) -> None:
        super().__init__()
        self.config = config
        self.register_buffer("low_m", torch.tensor(bounds.low_m, dtype=torch.float32))
        self.register_buffer("high_m", torch.tensor(bounds.high_m, dtype=torch.float32))
        # Double: seconds may be since the epoch, and a difference of two of them is used.
        self.register_buffer(
            "time_range_s", torch.tensor([bounds.start_s, bounds.end_s], dtype=torch.float64)
        )
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self._build()

    @classmethod
    def start(cls, config: HexPlaneConfig, given: Start) -> tuple["HexPlaneField", Gaussians]:
        """Planes over the box that holds nearly all Gaussians and over the time of the clip."""
        given.refuse_tracks(cls.kind)
        clip, means = given.clip, given.dynamic.means.numpy().astype(np.float64)
        low, high = np.quantile(means, [OUTSIDE, 1 - OUTSIDE], axis=0)
        bounds = Bounds(low, np.maximum(high, low + 1e-3), float(clip.times_s[0]), float(clip.times_s[-1]))
        config = replace(config, times=max(2, len(clip) // 2), coefficients=given.dynamic.sh.shape[1])
        return cls(config, bounds, given.seed), given.dynamic

    @classmethod
    def blank(cls, config: HexPlaneConfig) -> "HexPlaneField":
        """One of this shape with any valid numbers in it."""
        return cls(config, Bounds(np.zeros(3), np.ones(3), 0.0, 1.0))

    def check(self, gaussians: Gaussians) -> None:
        """Raise ``ValueError`` where they have another number of colour coefficients than the field."""
        if gaussians.sh.shape[1] != self.config.coefficients:
            raise ValueError(f"sh: {gaussians.sh.shape[1]} coefficients a channel for {self.config}")

    def _build(self) -> None:
        c = self.config
        sizes = [c.resolution * 2**level for level in range(c.levels)]
        self.space = nn.ParameterList(torch.empty(3, c.features, n, n).uniform_(0.1, 0.5) for n in sizes)
        self.time = nn.ParameterList(torch.ones(3, c.features, c.times, n) for n in sizes)
        self.trunk = nn.Linear(c.features * c.levels, c.width)
        self.head_mean = _head(c.width, 3)
        self.head_sh = _head(c.width, 3 * c.coefficients)

    def features(self, means: Float[Tensor, "n 3"], t_s: float) -> Float[Tensor, "n f"]:
        """Features (N, features * levels) of canonical means in metres at a time."""
        if in_core(means):
            lines = [self._slice(time, t_s)[:, :, 0] for time in self.time]
            return plane_features(means, self.low_m, self.high_m, list(self.space), lines)
        place = 2 * (means.detach() - self.low_m) / (self.high_m - self.low_m) - 1
        pairs = torch.stack([place[:, axes] for axes in _SPACE])
        lines = torch.stack([place.T, torch.zeros_like(place.T)], dim=-1)
        levels: list[Tensor] = []
        for space, time in zip(self.space, self.time, strict=True):
            six = (*_sample(space, pairs), *_sample(self._slice(time, t_s), lines))
            # The gradient of prod() asks each factor whether it is 0, which takes longer than all products.
            levels.append(reduce(torch.mul, six))
        return torch.cat(levels).T

    def _slice(self, planes: Float[Tensor, "3 c t r"], t_s: float) -> Float[Tensor, "3 c 1 r"]:
        """Planes with time at a time, which is the same for all Gaussians."""
        start_s, end_s = self.time_range_s.tolist()
        last = planes.shape[2] - 1
        node = min(max((t_s - start_s) / (end_s - start_s), 0.0), 1.0) * last
        before = min(int(node), last - 1)
        return torch.lerp(planes[:, :, before], planes[:, :, before + 1], node - before)[:, :, None]

    def apply_at(self, gaussians: Gaussians, t_s: float) -> Gaussians:
        """The Gaussians as they are at ``t_s``: moved and recoloured, their life spans untouched.

        float32 on the CPU goes through the compiled core; all else goes through plain torch.

        Raises:
            ValueError: They have another number of colour coefficients than the field.
        """
        if len(gaussians) == 0:
            return gaussians
        self.check(gaussians)
        offsets = self._decoded(self.features(gaussians.means, t_s))
        by_mean, by_sh = offsets.split([3, offsets.shape[1] - 3], dim=1)
        return replace(
            gaussians,
            means=gaussians.means + by_mean,
            sh=gaussians.sh + by_sh.view_as(gaussians.sh),
        )

    def _decoded(self, features: Float[Tensor, "n f"]) -> Float[Tensor, "n o"]:
        """Offsets of mean and colour of N features, side by side."""
        if not in_core(features):
            hidden = self.trunk(features)
            return torch.cat([self.head_mean(hidden), self.head_sh(hidden)], dim=1)
        (middle, middle_bias, mean, mean_bias), (other, other_bias, sh, sh_bias) = (
            tuple(head.parameters()) for head in (self.head_mean, self.head_sh)
        )
        # One layer for both heads, of which each reads its own half.
        width = self.config.width
        layers = [self.trunk.weight, self.trunk.bias]
        layers += [torch.cat([middle, other]), torch.cat([middle_bias, other_bias])]
        layers += [nn.functional.pad(mean, (0, width)), mean_bias, nn.functional.pad(sh, (width, 0)), sh_bias]
        return dense_network(features, 2, layers)

    def groups(self) -> dict[str, list[nn.Parameter]]:
        """Planes and decoder, which learn at different rates."""
        named = dict(self.named_parameters())
        planes = [p for name, p in named.items() if name.startswith(("space.", "time."))]
        return {"network": [p for p in named.values() if all(p is not q for q in planes)], "planes": planes}

    def penalty(self, canonical: Gaussians, moved: Gaussians) -> Float[Tensor, ""]:
        """Total variation, curvature along time, distance of planes with time from 1, and mean offsets."""
        c = self.config
        terms = [c.offset_weight * (moved.means - canonical.means).abs().mean()]
        terms += [c.offset_weight * (moved.sh - canonical.sh).abs().mean()]
        for space, time in zip(self.space, self.time, strict=True):
            # Means over three planes at once; the papers' terms add up plane by plane.
            terms += [_steepness(space, 3 * c.plane_weight)]
            terms += [3 * c.unity_weight * (time - 1).abs().mean()]
            if c.times > 2:
                terms += [3 * c.time_weight * time.diff(n=2, dim=2).square().mean()]
        return torch.stack(terms).sum()


def _head(width: int, outputs: int) -> nn.Sequential:
    last = nn.Linear(width, outputs)
    nn.init.zeros_(last.weight)
    nn.init.zeros_(last.bias)
    return nn.Sequential(nn.ReLU(), nn.Linear(width, width), nn.ReLU(), last)


def _sample(planes: Float[Tensor, "3 c h w"], places: Float[Tensor, "3 n 2"]) -> Float[Tensor, "3 c n"]:
    """Bilinear between nodes at places in [-1, 1], whose corners are the outermost nodes; clamped beyond."""
    grid = places[:, None]
    return nn.functional.grid_sample(planes, grid, padding_mode="border", align_corners=True)[:, :, 0]


def _steepness(planes: Float[Tensor, "3 c r r"], weight: float) -> Float[Tensor, ""]:
    """Weighted mean squares of the differences between neighbours along each axis."""
    if in_core(planes):
        return steepness(planes, weight)
    return weight * (planes.diff(dim=2).square().mean() + planes.diff(dim=3).square().mean())
