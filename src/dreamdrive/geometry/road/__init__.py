"""The road plane and the metric scale."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.geometry.road import scale as scale
    from dreamdrive.geometry.road.ground_sweep import Pair as Pair, RoadSweep as RoadSweep
    from dreamdrive.geometry.road.known_depth import (
        MIN_RATIOS as MIN_RATIOS,
        depth_points as depth_points,
        depth_ratios as depth_ratios,
        factor_of as factor_of,
        in_metres as in_metres,
    )
    from dreamdrive.geometry.road.scale import Metric as Metric, PosedClip as PosedClip

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
