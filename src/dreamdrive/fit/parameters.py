"""Gaussians while they are being fitted: leaf tensors, their Adam moments, and surgery on both."""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from dreamdrive.compute.device import CPU
from dreamdrive.fit.adam import Moments, adam_step
from dreamdrive.scene.gaussians import Gaussians

_LEARNED = ("offsets", "quaternions", "log_scales", "logit_opacities", "sh")
# Of Gaussians with velocities, besides.
_SWINGING = ("swings", "peak_s", "log_span")
_CARRIED = ("anchors", "unit_m", "source_frame", "features", "lifespan", "actor")


@dataclass(frozen=True)
class LearningRates:
    """Adam's step sizes.

    They are several times those of 3DGS, which has a hundred times the steps: with its own a fit takes twice
    the steps to the same held-out frames. With them to the end every frame would pull the scene its way;
    therefore all settle.

    Attributes:
        offsets: Positions, in units of each Gaussian's own pixel footprint. 3DGS steps 1.6e-4 of the scene's
            extent for all; on a street that spans 3 m to 250 m one metric step is either nothing or a jump.
        offsets_end: What ``offsets`` decays to, log-linearly.
        settle_after: Share of the steps after which the other steps on Gaussians begin to decay, too.
        settled: What they decay to, log-linearly, as a share. Without it drawn streets lose 0.4 dB in
            held-out frames.
        quaternions: Rotations.
        log_scales: Scales.
        logit_opacities: Opacities.
        sh_dc: Base colour.
        sh_rest: View-dependent colour.
        swings: Velocities, in footprints per frame interval. On the built-in street (1,000 steps) 0.05 lost
            0.7 dB on held-out frames.
        peak: Centres of life spans, in frame intervals; decays like ``offsets`` (PVG: 0.04).
        log_span: Logarithm of their deviations (PVG: 2e-3 over 30,000 steps). There 3e-3 lost 1.3 dB.
        interval_s: The frame interval of the two.
    """

    offsets: float = 0.08
    offsets_end: float = 0.008
    settle_after: float = 0.6
    settled: float = 0.2
    quaternions: float = 8e-3
    log_scales: float = 0.032
    logit_opacities: float = 0.12
    sh_dc: float = 0.016
    sh_rest: float = 1e-3
    swings: float = 0.02
    peak: float = 0.04
    log_span: float = 0.01
    interval_s: float = 0.1

    def shares(self, done: float) -> tuple[float, float]:
        """What is left of the steps of positions, and of the others that settle; ``done`` in [0, 1]."""
        late = max(0.0, done - self.settle_after) / (1 - self.settle_after)
        return (self.offsets_end / self.offsets) ** done, self.settled**late


class Parameters:
    """N Gaussians as leaf tensors with Adam's moments; a fit works on this and returns frozen ``Gaussians``.

    Positions are ``anchors + unit_m * offsets``: the offset is dimensionless, so that Adam's steps are a
    fraction of a pixel at any depth. Gaussians with velocities learn these, ``unit_m * swings`` in m/s, and
    their life spans.

    Attributes:
        rates: Step sizes.
        moments: Adam's memory of each leaf, by name.
    """

    def __init__(self, gaussians: Gaussians, unit_m: Float[Tensor, " n"], rates: LearningRates) -> None:
        self.rates = rates
        self.anchors = gaussians.means.clone()
        self.unit_m = unit_m.clone()
        self.source_frame = gaussians.source_frame.clone()
        self.features = gaussians.features
        self.lifespan = gaussians.lifespan
        self.actor = gaussians.actor
        self.offsets = torch.zeros_like(self.anchors)
        self.quaternions = gaussians.quaternions.clone()
        self.log_scales = gaussians.log_scales.clone()
        self.logit_opacities = gaussians.logit_opacities.clone()
        self.sh = gaussians.sh.clone()
        self._decay = self._settling = 1.0
        self._learned = _LEARNED
        if gaussians.velocity is not None:
            self._learned = (*_LEARNED, *_SWINGING)
            self._let_swing(gaussians.velocity, gaussians.lifespan)
        self.moments = {
            name: Moments(torch.zeros_like(leaf), torch.zeros_like(leaf))
            for name, leaf in ((name, self._leaf(name)) for name in self._learned)
        }

    def _let_swing(self, velocity: Float[Tensor, "n 3"], lifespan: Float[Tensor, "n 2"] | None) -> None:
        if lifespan is None:
            raise ValueError("parameters: Gaussians with velocities need life spans")
        self.lifespan = None
        self.swings = velocity / self.unit_m[:, None]
        self.peak_s, self.log_span = lifespan[:, 0].clone(), lifespan[:, 1].log()

    def _leaf(self, name: str) -> Tensor:
        leaf = getattr(self, name).contiguous().requires_grad_(True)
        setattr(self, name, leaf)
        return leaf

    def __len__(self) -> int:
        return len(self.anchors)

    @property
    def swinging(self) -> bool:
        """Whether they have velocities."""
        return "swings" in self._learned

    @property
    def means(self) -> Float[Tensor, "n 3"]:
        """Centres in metres, differentiable."""
        return torch.addcmul(self.anchors, self.unit_m[:, None], self.offsets)

    def gaussians(self) -> Gaussians:
        """The Gaussians as they are now, still attached to the leaves."""
        velocity, lifespan = None, self.lifespan
        if self.swinging:
            velocity = self.unit_m[:, None] * self.swings
            lifespan = torch.stack([self.peak_s, self.log_span.exp()], dim=1)
        return Gaussians(
            means=self.means,
            quaternions=self.quaternions,
            log_scales=self.log_scales,
            logit_opacities=self.logit_opacities,
            sh=self.sh,
            source_frame=self.source_frame,
            features=self.features,
            lifespan=lifespan,
            actor=self.actor,
            velocity=velocity,
        )

    def frozen(self) -> Gaussians:
        """A detached copy on the CPU."""
        now = self.gaussians().tensors()
        return Gaussians(**{name: value.detach().to(CPU, copy=True) for name, value in now.items()})

    def set_progress(self, done: float) -> None:
        """Decay the steps; ``done`` runs from 0 to 1."""
        self._decay, self._settling = self.rates.shares(done)

    def step(self) -> None:
        """One Adam step, then forget the gradients."""
        rates, settling = self.rates, self._settling
        adam_step(
            {name: getattr(self, name) for name in self._learned},
            self.moments,
            {
                "offsets": [rates.offsets * self._decay],
                "quaternions": [rates.quaternions * settling],
                "log_scales": [rates.log_scales * settling],
                "logit_opacities": [rates.logit_opacities * settling],
                "sh": [rates.sh_dc * settling] * 3 + [rates.sh_rest * settling] * 3 * (self.sh.shape[1] - 1),
                "swings": [rates.swings / rates.interval_s],
                "peak_s": [rates.peak * rates.interval_s * self._decay],
                "log_span": [rates.log_span],
            },
        )

    @torch.no_grad()
    def keep(self, mask: Bool[Tensor, " n"]) -> None:
        """Drop the Gaussians outside ``mask`` with their moments."""
        index = torch.nonzero(mask).squeeze(1)
        self._rebuild(lambda value: value[index])

    @torch.no_grad()
    def append_children(self, parents: Int[Tensor, " m"], changes: dict[str, Tensor]) -> None:
        """Append copies of ``parents`` with ``changes`` to some fields and fresh moments.

        Everything else, source frame, features, life span and actor included, is the parent's.
        """

        def extend(name: str, value: Tensor) -> Tensor:
            return torch.cat([value, changes.get(name, value[parents])])

        for name in _CARRIED:
            value = getattr(self, name)
            if value is not None:
                setattr(self, name, extend(name, value))
        self._swap_leaves(extend, lambda state: torch.cat([state, torch.zeros_like(state[parents])]))

    def _rebuild(self, pick: Callable[[Tensor], Tensor]) -> None:
        for name in _CARRIED:
            value = getattr(self, name)
            if value is not None:
                setattr(self, name, pick(value))
        self._swap_leaves(lambda _, value: pick(value), pick)

    def _swap_leaves(
        self, change: Callable[[str, Tensor], Tensor], change_state: Callable[[Tensor], Tensor]
    ) -> None:
        """Replace each leaf and carry its Adam moments over."""
        for name in self._learned:
            setattr(self, name, change(name, getattr(self, name).detach()))
            self._leaf(name)
            self.moments[name] = self.moments[name].changed(change_state)
