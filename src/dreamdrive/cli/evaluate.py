"""``dreamdrive evaluate``: figures of what was made, each kind a command of its own."""

from collections.abc import Callable
from functools import reduce
from operator import or_
from typing import Annotated, Any

from tyro.conf import OmitArgPrefixes, OmitSubcommandPrefixes, Suppress, subcommand

from dreamdrive.cli.evaluate_consistency import consistency
from dreamdrive.cli.evaluate_decomposition import decomposition
from dreamdrive.cli.evaluate_geometry import geometry
from dreamdrive.cli.evaluate_video import evaluate_video

EVALUATIONS: dict[str, Callable[..., None]] = {
    "video": evaluate_video,
    "consistency": consistency,
    "decomposition": decomposition,
    "geometry": geometry,
}

# As tyro does for the commands themselves; a union needs a second member where there is one command only.
_Choices = [Annotated[Any, subcommand(name, constructor=call)] for name, call in EVALUATIONS.items()]
_Evaluation = reduce(or_, (*_Choices, Annotated[None, Suppress]))


def evaluate(figures: Annotated[_Evaluation, OmitSubcommandPrefixes, OmitArgPrefixes]) -> None:  # pyright: ignore[reportInvalidTypeForm]
    """Measure how good results are.

    Args:
        figures: What to measure.
    """
