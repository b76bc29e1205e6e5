"""How a run is kept apart from others, and what it says."""

from dreamdrive.run import check, codec
from dreamdrive.run.lock import only_run
from dreamdrive.run.options_file import read_options
from dreamdrive.run.outcome import Outcome, lines_of, outcome_of, read_outcome
from dreamdrive.run.production import Production, start
from dreamdrive.run.report import PACKAGES, package_versions
from dreamdrive.run.request import Request, request_of
from dreamdrive.run.sampling import clip_features, sample
from dreamdrive.run.stages import STAGES, Run, Stages, call, digest, file_digest, program_digest, stage_seed
from dreamdrive.run.workspace import REPORT, check_ours, check_place, open_workspace
