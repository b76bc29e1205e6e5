"""How a run is kept apart from others, and what it says."""

from dreamdrive.run.agreement import (
    check_clip,
    check_geometry,
    check_grouping,
    check_scene,
    check_scores,
    check_seeds,
    check_static,
)
from dreamdrive.run.cost import announcement, check_memory, plan
from dreamdrive.run.held_out import score_baselines, score_scene
from dreamdrive.run.lock import only_run
from dreamdrive.run.outcome import Outcome, lines_of, outcome_of, read_outcome
from dreamdrive.run.report import PACKAGES, describe, package_versions
from dreamdrive.run.sampling import clip_features, sample
from dreamdrive.run.stages import STAGES, Stages, Storage, digest, file_digest, stage_seed
from dreamdrive.run.workspace import REPORT, Workspace, check_writable, open_workspace
