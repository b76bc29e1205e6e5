"""Equations of points that optical flow carries from frame to frame of a thing."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.sparse import csr_array

from dreamdrive.decompose.actors.observations import STATE, Carried, PlacingOptions, PointDepth
from dreamdrive.decompose.actors.smooth_motion import trust
from dreamdrive.scene.camera import NEAR_M, Camera

MOST_FACTOR = 0.7
"""Largest logarithm of a factor of depth."""


class CarriedPoints:
    """Where carried points should meet; the depth of each is an unknown of its own, solved for on the way.

    The unknown of a point is the logarithm of a factor of its depth, beside that of its frame.
    Points know nothing of one another, so each is eliminated from the equations of the states (the Schur
    complement of bundle adjustment), and follows the states afterwards.
    """

    def __init__(
        self,
        cameras: Sequence[Camera],
        carried: Sequence[Carried],
        up: Float[np.ndarray, "3"],
        options: PlacingOptions,
    ) -> None:
        self._up, self._options = up, options
        sizes = [len(each.first_m) for each in carried]
        self._pairs = [(each.first, each.second) for each in carried]
        ends = np.cumsum(sizes)
        self._slices = [slice(end - size, end) for end, size in zip(ends, sizes, strict=True)]
        self._first, self._second = (np.repeat(each, sizes) for each in zip(*self._pairs, strict=True))
        self._share = np.repeat([options.independent / size for size in sizes], sizes)
        numbers = np.column_stack([self._first, np.concatenate([each.point for each in carried])])
        self._points, which = np.unique(numbers, axis=0, return_inverse=True)
        self._which = which.reshape(-1)
        self._change = np.zeros(len(self._points))
        counted = np.zeros(len(self._points))
        np.maximum.at(counted, self._which, self._share)
        self._prior = counted / options.shape**2
        poses = np.stack([camera.world_from_camera for camera in cameras])
        self._centre = poses[self._first, :3, 3]
        seen = [cameras[each.first].lift(np.column_stack([each.first_px, each.first_m])) for each in carried]
        self._arm = np.concatenate(seen) - self._centre
        self._other = np.linalg.inv(poses)[self._second]
        lens = np.array([[c.fx_px, c.fy_px, c.cx_px, c.cy_px] for c in cameras])[self._second]
        self._focal, self._middle = lens[:, :2], lens[:, 2:]
        self._target = np.concatenate([each.second_px for each in carried])
        self._log_depth = np.log(np.concatenate([each.second_m for each in carried]))

    def terms(
        self, state: Float[np.ndarray, "k 5"], lost_px: float
    ) -> tuple[Float[np.ndarray, "m m"], Float[np.ndarray, " m"]]:
        """Normal matrix and gradient of the robust squares, for the states alone."""
        off, slopes = self._off_and_slopes(state)
        weighted = slopes * (self._weights(off, lost_px) * self._share[:, None])[..., None]
        normal, gradient = np.zeros((state.size, state.size)), np.zeros(state.size)
        for pair, own in zip(self._pairs, self._slices, strict=True):
            rows = np.concatenate([STATE * frame + np.arange(STATE) for frame in pair])
            heavy = weighted[own].reshape(-1, 2 * STATE).T
            normal[np.ix_(rows, rows)] += heavy @ slopes[own].reshape(-1, 2 * STATE)
            gradient[rows] += heavy @ off[own].ravel()
        # A point's own unknown acts as the factor of its frame does.
        own, weighted_own = slopes[..., STATE - 1], weighted[..., STATE - 1]
        self._stiff = self._of_points((weighted_own * own).sum(axis=1)) + self._prior
        self._pull = self._of_points((weighted_own * off).sum(axis=1)) + self._prior * self._change
        self._tied = self._ties(np.einsum("nri,nr->ni", weighted, own), state.size)
        eased = self._tied.copy()
        eased.data *= np.repeat(1 / self._stiff, np.diff(eased.indptr))
        normal -= (self._tied.T @ eased).toarray()
        gradient -= self._tied.T @ (self._pull / self._stiff)
        return normal, gradient

    def follow(self, step: Float[np.ndarray, "k 5"]) -> None:
        """Give each point the depth that is best after a step of the states."""
        change = self._change - (self._pull + self._tied @ step.ravel()) / self._stiff
        self._change = change.clip(-MOST_FACTOR, MOST_FACTOR)

    def depths(self, factor: Float[np.ndarray, " k"]) -> tuple[PointDepth, ...]:
        """What the points' depths are multiplied by, frame by frame, where this is the frames' own factor."""
        frame, number = self._points.T
        each = [frame == k for k in range(len(factor))]
        return tuple(
            PointDepth(number[rows], known * np.exp(self._change[rows]))
            for rows, known in zip(each, factor, strict=True)
        )

    def _of_points(self, values: Float[np.ndarray, " n"]) -> Float[np.ndarray, " p"]:
        return np.bincount(self._which, values, len(self._points))

    def _ties(self, values: Float[np.ndarray, "n 10"], size: int) -> csr_array:
        """Second derivatives by a point's unknown and the states of both its frames, a row a point."""
        columns = STATE * np.stack([self._first, self._second], axis=1)[..., None] + np.arange(STATE)
        rows = np.repeat(self._which, 2 * STATE)
        return csr_array((values.ravel(), (rows, columns.ravel())), shape=(len(self._points), size))

    def _weights(self, off: Float[np.ndarray, "n 3"], lost_px: float) -> Float[np.ndarray, "n 3"]:
        in_image = trust(np.hypot(off[:, 0], off[:, 1]) / lost_px) / self._options.flow_px**2
        in_depth = trust(off[:, 2] / self._options.depth / 3) / self._options.depth**2
        return np.column_stack([in_image, in_image, in_depth])

    def _off_and_slopes(
        self, state: Float[np.ndarray, "k 5"]
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3 10"]]:
        """By how much each point misses, in pixels and log depth, and its slopes by both frames' states."""
        one, other = state[self._first], state[self._second]
        arm = np.exp(one[:, 4] + self._change[self._which])[:, None] * self._arm
        turn = _about(self._up, other[:, 3] - one[:, 3])
        turned = np.einsum("nij,nj->ni", turn, self._centre + arm - one[:, :3])
        world, lens = self._other[:, :3, :3], self._focal
        local = np.einsum("nij,nj->ni", world, turned + other[:, :3]) + self._other[:, :3, 3]
        z = np.maximum(local[:, 2], NEAR_M)
        missed = lens * local[:, :2] / z[:, None] + self._middle - self._target
        off = np.column_stack([missed, np.log(z) - other[:, 4] - self._log_depth])
        picture = np.zeros((len(off), 3, 3))
        picture[:, [0, 1], [0, 1]] = lens / z[:, None]
        picture[:, :2, 2] = -lens * local[:, :2] / z[:, None] ** 2
        picture[:, 2, 2] = 1 / z
        moved = picture @ world
        before = moved @ turn
        slopes = np.zeros((len(off), 3, 2 * STATE))
        slopes[..., :3], slopes[..., STATE : STATE + 3] = -before, moved
        slopes[..., STATE + 3] = np.einsum("nij,nj->ni", moved, np.cross(self._up, turned))
        slopes[..., 3] = -slopes[..., STATE + 3]
        slopes[..., 4] = np.einsum("nij,nj->ni", before, arm)
        slopes[:, 2, STATE + 4] = -1
        return off, slopes


def _about(axis: Float[np.ndarray, "3"], angle_rad: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 3 3"]:
    """Turns about an axis (Rodrigues' formula)."""
    cosine, sine = np.cos(angle_rad)[:, None, None], np.sin(angle_rad)[:, None, None]
    along = np.outer(axis, axis)
    return along + cosine * (np.eye(3) - along) + sine * np.cross(axis, np.eye(3)).T
