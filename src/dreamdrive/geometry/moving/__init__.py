"""Evidence of motion in posed frames, outlines of moving things, oncoming traffic."""

from dreamdrive.geometry.moving.evidence import FLAGGED, moving_evidence, standing_evidence
from dreamdrive.geometry.moving.flow import PairFlow, neighbour_flows, pixel_grid
from dreamdrive.geometry.moving.users import too_near, whole_users
