"""Evidence of motion in posed frames, outlines of moving things, oncoming traffic."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.geometry.moving.evidence import (
        FLAGGED as FLAGGED,
        moving_evidence as moving_evidence,
        standing_evidence as standing_evidence,
    )
    from dreamdrive.geometry.moving.flow import (
        PairFlow as PairFlow,
        neighbour_flows as neighbour_flows,
        pixel_grid as pixel_grid,
    )
    from dreamdrive.geometry.moving.road_users import (
        too_near as too_near,
        whole_road_users as whole_road_users,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
