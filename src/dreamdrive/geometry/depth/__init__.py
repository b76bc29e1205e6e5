"""Plane sweep, its smoothing and its confidence."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.geometry.depth.confidence import (
        agreement as agreement,
        combine as combine,
        fill_flanks as fill_flanks,
        temporal_neighbours as temporal_neighbours,
    )
    from dreamdrive.geometry.depth.fusion import (
        PAVED as PAVED,
        Fused as Fused,
        fused as fused,
        with_stereo as with_stereo,
    )
    from dreamdrive.geometry.depth.in_time import settled_in_time as settled_in_time
    from dreamdrive.geometry.depth.one_frame import sweep_frames as sweep_frames
    from dreamdrive.geometry.depth.outlines import (
        weighted_median as weighted_median,
        with_outlines as with_outlines,
    )
    from dreamdrive.geometry.depth.preferred import (
        preferred as preferred,
        shifted_road_users as shifted_road_users,
    )
    from dreamdrive.geometry.depth.sky import above_horizon as above_horizon, sky_mask as sky_mask
    from dreamdrive.geometry.depth.sweep import (
        Correlation as Correlation,
        Warp as Warp,
        inside as inside,
        misfits as misfits,
        sample as sample,
    )
    from dreamdrive.geometry.depth.sweep_elsewhere import sweep_frames_on as sweep_frames_on
    from dreamdrive.geometry.depth.view import (
        PosedFrames as PosedFrames,
        Tell as Tell,
        by_frame as by_frame,
        make_view as make_view,
        unheard as unheard,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
