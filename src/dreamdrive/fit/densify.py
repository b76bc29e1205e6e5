"""Growing and pruning of Gaussians while they are fitted."""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from dreamdrive.compute.device import CPU
from dreamdrive.fit.parameters import Parameters


class Densifier:
    """What the trainer asks of a densification strategy; this one keeps the set as it was seeded."""

    def __init__(self, *unused: object) -> None:
        pass

    def observe(
        self, rows: Int[Tensor, " m"] | None, gradient_px: Float[Tensor, "m 2"], visible: Bool[Tensor, " m"]
    ) -> None:
        """Take in one step's gradient by the projected means, per pixel, of some rows or of all (None)."""

    def update(self, parameters: Parameters, step: int, steps: int, generator: torch.Generator) -> None:
        """Change the set after a step, if it is time."""


@dataclass(frozen=True)
class DensifySettings:
    """Which strategy, and the constants of ``GradientDensifier``, with the value of 3DGS where it differs.

    Attributes:
        strategy: Name in ``DENSIFIERS``.
        start: Share of the steps after which growing begins (3DGS: 500 of 30,000).
        stop: Share of the steps after which it ends (3DGS: 15,000 of 30,000).
        every: Steps between two changes.
        gradient: Mean gradient by the projected mean, in half-image units, from which a Gaussian grows.
        split_px: Largest deviation, over the seed's footprint, that is cloned (3DGS: 0.01 of the extent).
        shrink: A split divides the scales by this.
        prune_opacity: Below this a Gaussian is removed.
        prune_px: Above this size, in the same units as ``split_px``, a Gaussian is removed.
        most: Growth stops at this many Gaussians; the largest gradients go first.
    """

    strategy: str = "gradient"
    start: float = 0.15
    stop: float = 0.6
    every: int = 100
    gradient: float = 4e-4
    split_px: float = 2.0
    shrink: float = 1.6
    prune_opacity: float = 0.01
    prune_px: float = 60.0
    most: int = 120_000


class GradientDensifier(Densifier):
    """Clone small and split large Gaussians whose screen position wants to move; prune transparent ones.

    The rule of 3DGS with these differences: sizes are measured in units of each Gaussian's seed footprint
    (``Parameters.unit_m``), opacity is never reset (a clip is short: every frame would have to be revisited
    before the reset heals), and the number is capped.
    All constants are in ``DensifySettings``. Children keep source frame, features, life span and actor.
    """

    def __init__(
        self,
        settings: DensifySettings,
        count: int,
        half_size_px: tuple[float, float],
        device: torch.device = CPU,
    ) -> None:
        self.settings = settings
        self._half_size = torch.tensor(half_size_px, device=device)
        self._reset(count)

    def _reset(self, count: int) -> None:
        self._sum = torch.zeros(count, device=self._half_size.device)
        self._seen = torch.zeros_like(self._sum)

    def observe(
        self, rows: Int[Tensor, " m"] | None, gradient_px: Float[Tensor, "m 2"], visible: Bool[Tensor, " m"]
    ) -> None:
        """Add one step's gradients to the running mean over the views that saw each Gaussian."""
        # torch.linalg.vector_norm takes nearly twice as long over two numbers.
        strength = (gradient_px.square() @ self._half_size.square()).sqrt()
        if rows is None:
            self._sum += strength
            self._seen += visible
        else:
            self._sum.index_add_(0, rows, strength)
            self._seen.index_add_(0, rows, visible.to(self._seen.dtype))

    def update(self, parameters: Parameters, step: int, steps: int, generator: torch.Generator) -> None:
        """Clone, split and prune after every ``every``-th step inside the growing window."""
        s = self.settings
        if step == 0 or step % s.every or not s.start * steps <= step <= s.stop * steps:
            return
        self._grow(parameters, generator)
        with torch.no_grad():
            size = parameters.log_scales.exp().amax(1) / parameters.unit_m
            keep = (torch.sigmoid(parameters.logit_opacities) >= s.prune_opacity) & (size <= s.prune_px)
        parameters.keep(keep)
        self._reset(len(parameters))

    @torch.no_grad()
    def _grow(self, parameters: Parameters, generator: torch.Generator) -> None:
        s = self.settings
        mean_gradient = self._sum / self._seen.clamp(min=1)
        wanted = mean_gradient > s.gradient
        room = max(0, s.most - len(parameters))
        if int(wanted.sum()) > room:
            order = torch.argsort(mean_gradient, descending=True, stable=True)
            wanted = torch.zeros_like(wanted)
            wanted[order[:room]] = True
        large = parameters.log_scales.exp().amax(1) / parameters.unit_m > s.split_px
        clones = torch.nonzero(wanted & ~large).squeeze(1)
        parents = torch.nonzero(wanted & large).squeeze(1)
        smaller = parameters.log_scales[parents] - float(torch.log(torch.tensor(s.shrink, device="cpu")))
        halves = [self._sampled_inside(parameters, parents, generator) for _ in range(2)]
        if len(clones):
            parameters.append_children(clones, {})
        for anchors in halves if len(parents) else []:
            changes = {"anchors": anchors, "offsets": torch.zeros_like(anchors), "log_scales": smaller}
            parameters.append_children(parents, changes)
        alive = torch.ones(len(parameters), dtype=torch.bool, device=parents.device)
        alive[parents] = False
        parameters.keep(alive)

    @staticmethod
    def _sampled_inside(
        parameters: Parameters, index: Tensor, generator: torch.Generator
    ) -> Float[Tensor, "m 3"]:
        """A random point of each Gaussian at ``index``."""
        # Drawn where the generator is: the same numbers on every device.
        drawn = torch.randn(len(index), 3, generator=generator, device=generator.device)
        local = drawn.to(index.device) * parameters.log_scales[index].exp()
        w, xyz = parameters.quaternions[index].split([1, 3], dim=1)
        norm = torch.linalg.vector_norm(parameters.quaternions[index], dim=1, keepdim=True)
        w, xyz = w / norm, xyz / norm
        twice = 2 * torch.linalg.cross(xyz, local)
        return parameters.means[index] + local + w * twice + torch.linalg.cross(xyz, twice)


DENSIFIERS: dict[str, Callable[[DensifySettings, int, tuple[float, float], torch.device], Densifier]] = {
    "gradient": GradientDensifier,
    "none": Densifier,
}
"""Every strategy by name, made from settings, number of Gaussians, half the image in pixels, device."""
