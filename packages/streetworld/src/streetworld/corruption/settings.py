"""Settings of corruptions: which, how strong, and how a line of text asks for them."""

from dataclasses import dataclass, fields
from math import isfinite

from dreamdrive.errors import InputError


@dataclass(frozen=True)
class Corruption:
    """Strengths of what is wrong with generated video; 0 is off, 1 is a video model on a bad day.

    What a strength of 1 measures out at was taken at 320x192 and 24 frames: displacements over 30 seeds, grey
    levels (of 255) over 4 seeds on each of 4 built-in streets, all as RMS. Displacements grow with the
    width of the picture and in proportion to the strength; grey levels grow nearly so.

    Attributes:
        warp: Shapes wobble: 1.9 px off (0.6 % of the width), 0.7 px from one frame to the next, 2.0 px over
            8 frames, alike within about a sixth of the width.
        shimmer: Fine texture (below about 6 px) swims by 1.3 px, two fifths of it are lost and drawn anew as
            grain: 17 grey levels.
        flicker: Exposure and gamma of each frame, and exposure uneven over the picture: the mean of a frame
            is 4.2 grey levels off and jumps by 5.9 from one frame to the next.
        drift: White balance, contrast and saturation wander away from those of frame 0: 0.8 grey levels at
            frame 1, 12 at frame 23.
        far: The distance slides and bends against what is near: the sky by 4.4 px (1.0 degrees at a field of
            view of 64), 50 m by 3.5 px, 25 m by 2.2 px, 10 m by 0.6 px; the sky by 3.6 px over 8 frames.
            Needs depth.
        seed: Decides every random number; not negative.
    """

    warp: float = 0.0
    shimmer: float = 0.0
    flicker: float = 0.0
    drift: float = 0.0
    far: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in STRENGTHS:
            if not (isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise InputError(
                    f"corruption {name}={getattr(self, name):g}: expected a strength from 0 (off) to about 1"
                )
        if self.seed < 0:
            raise InputError(f"corruption: the seed is {self.seed}; expected 0 or more")

    @property
    def off(self) -> bool:
        """Whether nothing is corrupted."""
        return not any(getattr(self, name) > 0 for name in STRENGTHS)


STRENGTHS = tuple(field.name for field in fields(Corruption) if field.name != "seed")
PRESETS = {"generated": dict.fromkeys(STRENGTHS, 0.5)}


def parse_corruption(text: str, seed: int = 0) -> Corruption:
    """Read strengths such as ``warp=0.5,flicker=1`` or ``generated,far=0``.

    Names of ``STRENGTHS`` with a value, or of ``PRESETS``, stand between commas; a later one overrides.
    """
    strengths: dict[str, float] = {}
    for part in text.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if name in PRESETS and not equals:
            strengths |= PRESETS[name]
        elif name in STRENGTHS and equals:
            strengths[name] = _number(name, value)
        else:
            raise InputError(
                f"corruption {part.strip()!r}: expected {', '.join(f'{s}=STRENGTH' for s in STRENGTHS)} or "
                f"{', '.join(PRESETS)}, between commas, such as warp=0.5,flicker=1"
            )
    return Corruption(**strengths, seed=seed)


def _number(name: str, value: str) -> float:
    try:
        return float(value)
    except ValueError as error:
        raise InputError(f"corruption {name}={value}: expected a number, such as {name}=0.5") from error
