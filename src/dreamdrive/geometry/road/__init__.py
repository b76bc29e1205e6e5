"""The road plane and the metric scale."""

from dreamdrive.geometry.road import scale
from dreamdrive.geometry.road.ground_sweep import Pair, Road
from dreamdrive.geometry.road.known_depth import MIN_RATIOS, depth_points, depth_ratios, factor_of, in_metres
from dreamdrive.geometry.road.scale import Metric, Street
