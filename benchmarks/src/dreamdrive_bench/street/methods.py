"""What the street benchmark compares, by name: the representations, and some at the sizes of their papers."""

from dataclasses import replace

from dreamdrive.motion import DeformationConfig, HexPlaneConfig, MotionConfig
from dreamdrive.options import QUALITIES, Options, with_method
from dreamdrive_bench.common.twin import TWIN
from dreamdrive_bench.street.fit import with_steps

QUALITY = replace(QUALITIES["draft"], knowledge=TWIN)
OURS = "hybrid"
REPRESENTATIONS = ("hybrid", "static", "vibration", "deformable", "hexplane")


class FourLevels(Options):
    """Feature planes as S3Gaussian has them: four levels, 32 channels."""

    @property
    def motion(self) -> MotionConfig:
        """See ``Options``."""
        return HexPlaneConfig(levels=4, features=32)


FULL_SIZE: dict[str, Options] = {
    "deformable-8x256": replace(
        QUALITY, representation="deformable", network=DeformationConfig(depth=8, width=256)
    ),
    "hexplane-4x32": FourLevels(**{**vars(QUALITY), "representation": "hexplane"}),
    "whole-paper": with_method(QUALITY, "paper"),
}
"""Methods at the size that their authors give them, and the whole of the paper, eq. 5 to 14 as printed."""
METHODS = (*REPRESENTATIONS, *FULL_SIZE)


def options_of(method: str) -> Options:
    """The options of a method; all take the same steps."""
    if method in FULL_SIZE:
        return with_steps(FULL_SIZE[method], QUALITY.fit.steps, QUALITY.static.steps)
    return replace(QUALITY, representation=method)  # pyright: ignore[reportArgumentType]
