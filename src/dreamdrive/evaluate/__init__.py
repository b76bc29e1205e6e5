"""Evaluation: figures of results with their sample counts, floors and intervals."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.evaluate.actor_boxes import BoxError as BoxError
    from dreamdrive.evaluate.actor_places import gaussians_of as gaussians_of, offset_m as offset_m
    from dreamdrive.evaluate.clips.bootstrap import (
        MIN_SAMPLES as MIN_SAMPLES,
        distance_with_interval as distance_with_interval,
        half_distances as half_distances,
    )
    from dreamdrive.evaluate.clips.clips import read_frames as read_frames
    from dreamdrive.evaluate.clips.extractors import (
        Extractor as Extractor,
        Toolbox as Toolbox,
        WeightFiles as WeightFiles,
        open_toolbox as open_toolbox,
    )
    from dreamdrive.evaluate.clips.frechet import (
        frechet_distance as frechet_distance,
        kernel_distance as kernel_distance,
    )
    from dreamdrive.evaluate.clips.video import (
        VideoReport as VideoReport,
        VideoSettings as VideoSettings,
        evaluate_video as evaluate_video,
        windows as windows,
    )
    from dreamdrive.evaluate.consistency import (
        Consistency as Consistency,
        evaluate_consistency as evaluate_consistency,
    )
    from dreamdrive.evaluate.decomposition import (
        Decomposition as Decomposition,
        evaluate_decomposition as evaluate_decomposition,
    )
    from dreamdrive.evaluate.estimate import Estimate as Estimate
    from dreamdrive.evaluate.geometry import (
        BANDS_M as BANDS_M,
        STANDING_M as STANDING_M,
        DepthFigures as DepthFigures,
        GeometryFigures as GeometryFigures,
        depth_errors as depth_errors,
        evaluate_geometry as evaluate_geometry,
        median_scale as median_scale,
    )
    from dreamdrive.evaluate.geometry_picture import draw_geometry_errors as draw_geometry_errors
    from dreamdrive.evaluate.truth.drawn import Truth as Truth, read_truth as read_truth, views_of as views_of
    from dreamdrive.evaluate.truth.geometry import (
        GeometryTruth as GeometryTruth,
        of_drive as of_drive,
        read_geometry_truth as read_geometry_truth,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
