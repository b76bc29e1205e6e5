"""The upright box of an actor, from what frames saw of it and from how large road users are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.decompose.actors.life_spans import ActorView
from dreamdrive.scene.geometry import Ground

_OUTER = 0.02  # share of the points that lie outside
_VEHICLES_M = (1.9, 4.4, 1.85), (2.7, 5.3, 2.05), (np.inf, 8.0, 2.4)  # up to a height: length, width
_SMALL_M = {"two-wheeler": (1.8, 0.6), "person": (0.6, 0.6)}
_LEAST_M = 0.1  # of a side
_OVER_ROAD_M = 0.5  # up to which a bottom stands on the road
_CLEARANCE_M = 1.2  # up to which a vehicle's lowest part is over the road: the box of a lorry, without wheels
_LIKE = 0.9, 1.15  # shares of a usual size between which a side counts as seen whole


@dataclass(frozen=True)
class Body:
    """A box along three axes, ahead, left and up: unit vectors, a row each.

    ``seen_m`` is the span that was seen along each axis, ``whole_m`` the one that the thing is taken to have.
    """

    axes: Float[np.ndarray, "3 3"]
    seen_m: Float[np.ndarray, "3 2"]
    whole_m: Float[np.ndarray, "3 2"]

    @property
    def size_m(self) -> Float[np.ndarray, "3"]:
        """Length, width and height."""
        return np.maximum(np.ptp(self.whole_m, axis=1), _LEAST_M)

    @property
    def foot_m(self) -> Float[np.ndarray, "3"]:
        """The middle of the bottom."""
        along, across, height = self.whole_m
        return np.array([along.mean(), across.mean(), height[0]]) @ self.axes


def body_of(
    places: Float[np.ndarray, "n 3"],
    ahead: Float[np.ndarray, "3"],
    up: Float[np.ndarray, "3"],
    views: Sequence[ActorView],
    kind: str,
    ground: Ground | None,
) -> Body:
    """The box of a thing of which places were seen, all in its canonical place.

    A vehicle that shows one end alone reaches as far from the eyes as vehicles usually do. Its bottom is on
    the road if it is near it: what lies that low counts as road. ``ahead`` is where it points, ``up`` the
    axis of yaw.
    """
    axes = np.stack([ahead, np.cross(up, ahead), up])
    seen = np.quantile(places @ axes.T, [_OUTER, 1 - _OUTER], axis=0).T
    whole = seen.copy()
    eyes = np.stack([np.linalg.inv(g.world_from_canonical) @ g.camera.world_from_camera[:, 3] for g in views])
    for axis, usual_m in enumerate(_usual(kind, _tall_m(axes, seen, ground))):
        least, most = np.array(_LIKE) * usual_m
        if kind in _SMALL_M:
            whole[axis] = seen[axis].mean() + np.array([-0.5, 0.5]) * usual_m
        elif not least < np.ptp(seen[axis]) < most:
            whole[axis] = _reaching(seen[axis], eyes[:, :3] @ axes[axis], usual_m)
    body = Body(axes, seen, whole)
    if ground is not None:
        above_m = float(ground.height_m(body.foot_m[None])[0])
        whole[2, 0] -= above_m if abs(above_m) < _OVER_ROAD_M else 0
    return body


def _tall_m(axes: Float[np.ndarray, "3 3"], seen_m: Float[np.ndarray, "3 2"], ground: Ground | None) -> float:
    """How high a thing reaches over the road, of whose lowest part little may be seen."""
    span_m = float(np.ptp(seen_m[2]))
    if ground is None:
        return span_m
    along, across, height = seen_m
    under_m = float(ground.height_m(np.array([[along.mean(), across.mean(), height[0]]]) @ axes)[0])
    return span_m + (under_m if 0 < under_m < _CLEARANCE_M else 0)


def _usual(kind: str, tall_m: float) -> Sequence[float]:
    """Length and width that a thing of this kind and height usually has; what is unknown may be a vehicle."""
    if kind in _SMALL_M:
        return _SMALL_M[kind]
    return next(usual for height_m, *usual in _VEHICLES_M if tall_m < height_m)


def _reaching(
    seen_m: Float[np.ndarray, "2"], eyes_m: Float[np.ndarray, " k"], usual_m: float
) -> Float[np.ndarray, "2"]:
    """A span of the usual length from that end of what was seen to which most eyes are nearer."""
    from_above, from_below = (eyes_m > seen_m[1]).sum(), (eyes_m < seen_m[0]).sum()
    if from_above == from_below:
        return seen_m.mean() + np.array([-0.5, 0.5]) * usual_m
    if from_above > from_below:
        return np.array([seen_m[1] - usual_m, seen_m[1]])
    return np.array([seen_m[0], seen_m[0] + usual_m])
