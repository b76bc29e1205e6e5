"""The two video models that share one network: Stable Video Diffusion, and Vista, which is made from it."""

from dataclasses import dataclass

ACTION_COLUMNS = 2432
"""Width of the context that describes the action: 19 numbers of 128 columns."""


@dataclass(frozen=True)
class ModelKind:
    """What tells one model's use from the other's.

    It is told the frame rate that its frames have, and the standard deviation of the noise on the first one.
    A round starts from the ``overlap`` last frames of the one before, and as many leading ones can be fixed;
    0 where there is one round only.
    """

    name: str
    title: str
    rate_hz: float
    noise: float
    steps: int
    overlap: int


SVD = ModelKind("svd", "Stable Video Diffusion", rate_hz=7.0, noise=0.02, steps=25, overlap=0)
VISTA = ModelKind("vista", "Vista", rate_hz=10.0, noise=0.0, steps=50, overlap=3)
KINDS: dict[str, ModelKind] = {kind.name: kind for kind in (SVD, VISTA)}
MOTION_BUCKET = 127
"""How much motion both are asked for; the value of Vista's sampling script and of SVD's pipeline."""
