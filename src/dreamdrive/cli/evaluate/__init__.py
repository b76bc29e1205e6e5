"""``dreamdrive evaluate``: figures of what was made, each kind a command of its own."""

from typing import Annotated

from tyro.conf import OmitArgPrefixes, OmitSubcommandPrefixes

from dreamdrive.cli.evaluate.consistency import consistency
from dreamdrive.cli.evaluate.decomposition import decomposition
from dreamdrive.cli.evaluate.geometry import geometry
from dreamdrive.cli.evaluate.perception import perception
from dreamdrive.cli.evaluate.video import evaluate_video
from dreamdrive.cli.terminal.arguments import commands_of

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
