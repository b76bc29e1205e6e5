"""What the street benchmark compares, by name: the representations, and some at the sizes of their papers."""

from dataclasses import replace
from typing import get_args

from dreamdrive import options as presets
from dreamdrive.fit import MotionConfig, Representation
from dreamdrive.options import QUALITIES, Options
from dreamdrive.scene.deformation import DeformationConfig
from dreamdrive.scene.hexplane import HexPlaneConfig
from street.fit import with_steps

QUALITY = QUALITIES["draft"]
OURS = "hybrid"
REPRESENTATIONS: tuple[Representation, ...] = ("hybrid", "static", "vibration", "deformable", "hexplane")
assert set(REPRESENTATIONS) == set(get_args(Representation))


class FourLevels(Options):
    """Feature planes as S3Gaussian has them: four levels, 32 channels."""

    @property
    def motion(self) -> MotionConfig:
        """See ``Options``."""
        return HexPlaneConfig(levels=4, features=32)


PAPER: Options | None = getattr(presets, "PAPER", None)
"""The method as the paper has it, where the program offers it as ``dreamdrive.options.PAPER``."""
FULL_SIZE: dict[str, Options] = {
    "deformable-8x256": replace(
        QUALITY, representation="deformable", network=DeformationConfig(depth=8, width=256)
    ),
    "hexplane-4x32": FourLevels(**{**vars(QUALITY), "representation": "hexplane"}),
    **({} if PAPER is None else {"whole-paper": PAPER}),
}
"""Methods at the size that their authors give them."""
METHODS = (*REPRESENTATIONS, *FULL_SIZE)


def options_of(method: str) -> Options:
    """The options of a method; all take the same steps."""
    if method in FULL_SIZE:
        return with_steps(FULL_SIZE[method], QUALITY.fit.steps, QUALITY.static.steps)
    return replace(QUALITY, representation=method)  # pyright: ignore[reportArgumentType]
