"""Static and dynamic, told apart without labels."""

from dreamdrive.decompose.actors import ActorOptions, Cast, cast
from dreamdrive.decompose.errors import error_maps
from dreamdrive.decompose.group import Grouping, GroupOptions, group
from dreamdrive.decompose.score import ScoreNetwork, ScoreOptions, score

__all__ = [
    "ActorOptions",
    "Cast",
    "GroupOptions",
    "Grouping",
    "ScoreNetwork",
    "ScoreOptions",
    "cast",
    "error_maps",
    "group",
    "score",
]
