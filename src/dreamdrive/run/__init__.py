"""Runs: kept apart from others, resumable, reported."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.run import codec as codec
    from dreamdrive.run.kept import (
        is_kept as is_kept,
        kept_clip as kept_clip,
        kept_geometry as kept_geometry,
        kept_scores as kept_scores,
        kept_static as kept_static,
        stages_of as stages_of,
    )
    from dreamdrive.run.lock import only_run as only_run
    from dreamdrive.run.options_file import read_options as read_options
    from dreamdrive.run.production import (
        FIRST_PICTURE as FIRST_PICTURE,
        Production as Production,
        start as start,
    )
    from dreamdrive.run.program import program_digest as program_digest, program_of as program_of
    from dreamdrive.run.report.document import PACKAGES as PACKAGES, package_versions as package_versions
    from dreamdrive.run.report.held_out import (
        Likeness as Likeness,
        likeness as likeness,
        score_baselines as score_baselines,
        score_scene as score_scene,
    )
    from dreamdrive.run.report.outcome import (
        Outcome as Outcome,
        lines_of as lines_of,
        outcome_of as outcome_of,
        read_outcome as read_outcome,
    )
    from dreamdrive.run.request import Request as Request, request_of as request_of
    from dreamdrive.run.sampling import clip_features as clip_features, sample as sample
    from dreamdrive.run.stages import STAGES as STAGES, Stages as Stages
    from dreamdrive.run.workspace import (
        REPORT as REPORT,
        check_ours as check_ours,
        open_workspace as open_workspace,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
