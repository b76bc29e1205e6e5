"""The two video models that share one network: Stable Video Diffusion, and Vista, which is made from it."""

from dataclasses import dataclass
from typing import Literal

KindName = Literal["svd", "vista"]
ACTION_COLUMNS = 2432
"""Width of the context that describes the action: 19 numbers of 128 columns."""


@dataclass(frozen=True)
class Kind:
    """What tells one model's use from the other's.

    Attributes:
        name: For the command line.
        title: For people.
        rate_hz: Frame rate that it is told and whose frames it makes.
        noise: Standard deviation of the noise on the first frame, of which it is told.
        steps: Of the sampler, unless told.
        overlap: Frames of one round that the next one starts from; 0 where there is one round only. As many
            leading frames can be fixed.
    """

    name: KindName
    title: str
    rate_hz: float
    noise: float
    steps: int
    overlap: int


SVD = Kind("svd", "Stable Video Diffusion", rate_hz=7.0, noise=0.02, steps=25, overlap=0)
VISTA = Kind("vista", "Vista", rate_hz=10.0, noise=0.0, steps=50, overlap=3)
KINDS: dict[str, Kind] = {kind.name: kind for kind in (SVD, VISTA)}
MOTION_BUCKET = 127
"""How much motion both are asked for; the value of Vista's sampling script and of SVD's pipeline."""
