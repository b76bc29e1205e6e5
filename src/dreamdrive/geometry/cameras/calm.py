"""A path without the errors of single frames."""

from dataclasses import replace

import numpy as np

from dreamdrive.geometry.cameras import odometry, turning
from dreamdrive.geometry.cameras.paths import rebase
from dreamdrive.geometry.evidence import observe
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry


def calmed(clip: Clip, geometry: Geometry) -> Geometry:
    """The geometry of a clip of one camera on a smooth path, turned to and fro as its frames show.

    For a street that does not stand on the path that was found: then the errors of single poses shake what
    moves as the picture does. On six such drives held-out frames win 0.4 dB in the mean, -0.3 to 1.3.
    """
    evidence = observe(clip)
    poses = np.stack([camera.world_from_camera for camera in geometry.cameras])
    poses = odometry.steadied(poses, clip.times_s)
    poses = turning.shaken(poses, evidence.grey, evidence.street, evidence.small)
    poses, _ = rebase(poses, np.zeros((0, 3)))
    cameras = tuple(each.at(pose) for each, pose in zip(geometry.cameras, poses, strict=True))
    return replace(geometry, cameras=cameras)
