"""Plane sweep, its smoothing and its confidence."""

from dreamdrive.geometry.depth.confidence import agreement, combine, fill_flanks, temporal_neighbours
from dreamdrive.geometry.depth.fusion import PAVED, Fused, fused, with_stereo
from dreamdrive.geometry.depth.in_time import settled_in_time
from dreamdrive.geometry.depth.one_frame import sweep_frames
from dreamdrive.geometry.depth.outlines import weighted_median, with_outlines
from dreamdrive.geometry.depth.preferred import preferred, shifted_users
from dreamdrive.geometry.depth.sky import above_horizon, sky_mask
from dreamdrive.geometry.depth.sweep import Correlation, Warp, inside, misfits, sample
from dreamdrive.geometry.depth.view import (
    Tell,
    View,
    by_frame,
    make_view,
    parallel,
    single_threaded_opencv,
    unheard,
)
