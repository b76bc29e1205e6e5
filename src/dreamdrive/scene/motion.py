"""What scenes and fits ask of a representation of motion."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import torch
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.scene.gaussians import Gaussians


class Motion(nn.Module, ABC):
    """Where the dynamic Gaussians are over time.

    Attributes:
        kind: Its name on disk.
        config: A dataclass that rebuilds it together with its ``state_dict``, see ``stored_motion``.
    """

    kind: ClassVar[str]
    config: Any

    @abstractmethod
    def apply_at(self, gaussians: Gaussians, t_s: float) -> Gaussians:
        """The Gaussians as they are at ``t_s``, differentiable; the result has no life spans left."""

    def groups(self) -> dict[str, list[nn.Parameter]]:
        """What is learned, by the name of its step size in ``fit.FitOptions``; see ``fit.trainer.RATES``."""
        return {"network": list(self.parameters())}

    def training_at(self, gaussians: Gaussians, t_s: float, generator: torch.Generator) -> Gaussians:
        """What a step of the fit renders at ``t_s``; the same as a scene unless a method says otherwise."""
        return self.apply_at(gaussians, t_s)

    def penalty(self, canonical: Gaussians, moved: Gaussians) -> Float[Tensor, ""] | None:
        """A term to add to the loss of a step, weighted; None for none.

        Args:
            canonical: What went into ``training_at``.
            moved: What came out.
        """
        return None
