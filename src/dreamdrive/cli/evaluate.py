"""``dreamdrive evaluate``: figures of what was made, each kind a command of its own."""

from typing import Annotated

from tyro.conf import OmitArgPrefixes, OmitSubcommandPrefixes

from dreamdrive.cli.arguments import commands_of
from dreamdrive.cli.evaluate_consistency import consistency
from dreamdrive.cli.evaluate_decomposition import decomposition
from dreamdrive.cli.evaluate_geometry import geometry
from dreamdrive.cli.evaluate_perception import perception
from dreamdrive.cli.evaluate_video import evaluate_video

_Evaluation = commands_of(
    {
        "video": evaluate_video,
        "consistency": consistency,
        "decomposition": decomposition,
        "geometry": geometry,
        "perception": perception,
    }
)


def evaluate(figures: Annotated[_Evaluation, OmitSubcommandPrefixes, OmitArgPrefixes]) -> None:  # pyright: ignore[reportInvalidTypeForm]
    """Measure how good results are.

    Args:
        figures: What to measure.
    """
