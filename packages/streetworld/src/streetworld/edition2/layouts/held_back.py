"""Split of appearances: a fifth is kept for streets that no network is trained on."""

from dataclasses import dataclass

import numpy as np

FIRST_TRAINING_SEED = 1_000_000
"""Streets of smaller seeds have only looks that are kept out, those of larger ones only the others."""
LOOKS = 10_000
_FIFTH = 5
_KEPT = 4


@dataclass(frozen=True)
class Looks:
    """Draws looks; equal numbers look the same."""

    rng: np.random.Generator
    kept_out: bool

    def grain(self, seed: int) -> int:
        """A number of the street's own share that stands for a seed: what decides grounds and skies."""
        return _FIFTH * seed + (_KEPT if self.kept_out else seed % _KEPT)

    def draw(self) -> int:
        """A look of the street's own share."""
        group = _FIFTH * int(self.rng.integers(LOOKS // _FIFTH))
        return group + (_KEPT if self.kept_out else int(self.rng.integers(_KEPT)))
