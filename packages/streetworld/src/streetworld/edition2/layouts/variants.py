"""Variants that an appearance's number decides, a part of each kept out of training."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from dreamdrive.scene.street.layout import BoxKind

Colour = tuple[float, float, float]
"""Red, green and blue in 0..255."""

T = TypeVar("T")

_KINDS: tuple[BoxKind, ...] = ("car", "van", "truck", "bus", "motorcycle", "bicycle", "pedestrian")
_FIFTH = 5
_PAINTS: tuple[tuple[float, Colour], ...] = (
    (0.23, (226, 227, 225)),
    (0.19, (22, 23, 26)),
    (0.10, (82, 85, 89)),
    (0.09, (118, 121, 124)),
    (0.14, (178, 181, 184)),
    (0.05, (28, 48, 96)),
    (0.05, (46, 84, 142)),
    (0.05, (148, 26, 30)),
    (0.02, (98, 20, 28)),
    (0.02, (108, 86, 66)),
    (0.02, (176, 162, 136)),
    (0.01, (34, 62, 48)),
    (0.01, (86, 128, 92)),
    (0.01, (224, 176, 38)),
    (0.005, (222, 104, 34)),
    (0.005, (126, 170, 196)),
)
"""Share of the cars of a European or American street with each colour, roughly."""


def is_kept_out(look: int) -> bool:
    """Whether a look is one of the fifth whose shapes and textures no other look has.

    A network that is trained without these looks can be tested on bodies that it never saw.
    """
    return look % _FIFTH == _FIFTH - 1


class Draw:
    """Random choices of one look of a kind, the same each time.

    A look that is kept out chooses from the last fifth of a range or of options, and any other from the rest.
    """

    def __init__(self, kind: BoxKind, look: int) -> None:
        self.kind = kind
        self.rng = np.random.default_rng([look, _KINDS.index(kind)])
        self.kept_out = is_kept_out(look)

    def between(self, low: float, high: float) -> float:
        """A proportion."""
        share = self.rng.random() / _FIFTH
        return low + (high - low) * (share + 0.8 if self.kept_out else share * (_FIFTH - 1))

    def option(self, options: Sequence[T]) -> T:
        """One of five or more: shape families, prints, designs."""
        held = max(1, len(options) // _FIFTH)
        own = options[-held:] if self.kept_out else options[:-held]
        return own[int(self.rng.integers(len(own)))]

    def chance(self, share: float) -> bool:
        """True this often."""
        return bool(self.rng.random() < share)

    def any_of(self, options: Sequence[T]) -> T:
        """One of what is alike in all looks, such as colours."""
        return options[int(self.rng.integers(len(options)))]

    def paint(self) -> Colour:
        """Colour of a car's body."""
        shares = np.array([share for share, _ in _PAINTS])
        colour = _PAINTS[int(self.rng.choice(len(_PAINTS), p=shares / shares.sum()))][1]
        red, green, blue = self.rng.uniform(0.85, 1.1) * np.array(colour)
        return self.near((red, green, blue), 3)

    def near(self, colour: Colour, spread: float) -> Colour:
        """A colour like another."""
        red, green, blue = np.clip(np.array(colour) + self.rng.normal(0, spread, 3), 4, 250)
        return float(red), float(green), float(blue)

    def muted(self) -> Colour:
        """Any colour as cloth has it: greyer."""
        red, green, blue = self.rng.uniform(0.3, 1.0) * np.array(self.bright()) + self.rng.uniform(0, 60)
        mean, grey = (red + green + blue) / 3, float(self.rng.uniform(0.1, 0.7))
        return red + grey * (mean - red), green + grey * (mean - green), blue + grey * (mean - blue)

    def bright(self) -> Colour:
        """Any colour, of clothes or of letters."""
        red, green, blue = self.rng.uniform(10, 240, 3)
        return float(red), float(green), float(blue)
