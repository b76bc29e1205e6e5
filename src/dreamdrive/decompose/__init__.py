"""Static and dynamic, told apart without labels."""

from dreamdrive.decompose.actors import ActorOptions, Cast, cast
from dreamdrive.decompose.between import with_between
from dreamdrive.decompose.drifting import DriftOptions, drifting, outside, pixels_of, stands, without_sky
from dreamdrive.decompose.errors import error_maps
from dreamdrive.decompose.flow import in_between, neighbour_flow
from dreamdrive.decompose.glances import Placement, PlacingOptions
from dreamdrive.decompose.group import Grouping, GroupOptions, group, source_pixels
from dreamdrive.decompose.paths import Path, find_path
from dreamdrive.decompose.score import ScoreNetwork, ScoreOptions, score
