"""A drive that stays where a scene can be believed."""

import math

import numpy as np
from jaxtyping import Float
from scipy.ndimage import minimum_filter1d

from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.trust.reach import FALL_DB
from dreamdrive.trust.trust import HALF_RMS, SceneTrust

LEAST_DB = -20 * math.log10(HALF_RMS)
"""PSNR at which trust is one half: 22 dB."""
_PLACES = 16
_HALVINGS = 6


def within_trust(trust: SceneTrust, path: Trajectory, recorded: Trajectory) -> Trajectory:
    """A drive drawn towards the recorded one, so far that less than one half is believed nowhere.

    Where the recorded drive itself is hardly better, it is held to ``FALL_DB`` below that.

    At some places, evenly in time, the largest share of the way from the nearest recorded pose to that of the
    drive is sought by halving; between them it is the least of both, smoothed. Times stay.

    Args:
        trust: Of the scene.
        path: The drive, of the scene's first camera.
        recorded: The path that it was recorded on.
    """
    near = _nearest(path, recorded)
    rows = np.unique(np.linspace(0, len(path) - 1, min(_PLACES, len(path))).round().astype(int))
    poses, times_s = path.world_from_camera, path.times_s
    shares = np.array([_share(trust, near[row], poses[row], float(times_s[row])) for row in rows])
    if (shares == 1).all():
        return path
    # A place between two of those that were tried is held to the worse of them.
    least = minimum_filter1d(shares, 3, mode="nearest") if len(shares) > 2 else shares
    everywhere = np.interp(np.arange(len(path)), rows, least)
    drawn = [_between(*each) for each in zip(near, poses, everywhere.tolist(), strict=True)]
    return Trajectory(np.stack(drawn), times_s)


def _share(
    trust: SceneTrust, near: Float[np.ndarray, "4 4"], pose: Float[np.ndarray, "4 4"], t_s: float
) -> float:
    camera = trust.scene.cameras[0]

    def expected_db(share: float) -> float:
        return trust.view(camera.at(_between(near, pose, share)), t_s).psnr_db

    least_db = min(LEAST_DB, expected_db(0.0) - FALL_DB)
    if expected_db(1.0) >= least_db:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if expected_db(middle) >= least_db else (low, middle)
    return low


def _nearest(path: Trajectory, recorded: Trajectory) -> Float[np.ndarray, "t 4 4"]:
    """The pose of the recorded drive that is nearest to each of another one."""
    away_m = np.linalg.norm(path.positions_m[:, None] - recorded.positions_m, axis=2)
    return recorded.world_from_camera[away_m.argmin(axis=1)]


def _between(
    one: Float[np.ndarray, "4 4"], other: Float[np.ndarray, "4 4"], share: float
) -> Float[np.ndarray, "4 4"]:
    way = Trajectory(np.stack([one, other]), np.array([0.0, 1.0]))
    return way.at(np.array([share]))[0]
