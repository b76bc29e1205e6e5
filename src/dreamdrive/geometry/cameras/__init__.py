"""Structure from motion and its gate, focal length, odometry, known poses, checks of paths."""

from dreamdrive.geometry.cameras import contradiction, odometry, sfm
from dreamdrive.geometry.cameras.calm import calmed
from dreamdrive.geometry.cameras.creeping import with_creep
from dreamdrive.geometry.cameras.focal import settle
from dreamdrive.geometry.cameras.mapping import STEPS
from dreamdrive.geometry.cameras.paths import fill, rebase, stands, unit_in, without_poses
from dreamdrive.geometry.cameras.posing import MIN_TRACKS, Posed, as_posed, pose_clip
from dreamdrive.geometry.cameras.refine import refined
