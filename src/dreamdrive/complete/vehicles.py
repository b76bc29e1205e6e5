"""Standing vehicles that the border of every picture cuts off: closed by what is seen of them."""

from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Bool

from dreamdrive.complete.borders import Border
from dreamdrive.complete.mirror import plain, road_user_of, turned, unseen
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene

_LEAST_PX = 200  # less of it tells nothing
_RIM_PX = 2
_CLOSED_M = 0.6  # half of what a rear that is seen mostly lacks, and too little for a second car
_NEAR_M = 15.0  # farther off nobody sees behind it
_MOVES = 0.5


def with_vehicles_closed(scene: Scene, geometry: Geometry) -> Scene:
    """The scene with standing vehicles closed that no view shows whole.

    What lies just inside of the border is mirrored at it: a flank turns a corner there, and a rear goes on.
    What any view shows stays as it is, and so does a vehicle that one shows whole.
    """
    if geometry.road_users is None:
        return scene
    static = plain(scene.static)
    users = road_user_of(static, geometry)
    for number, (view, side) in _cut_off(geometry, scene.held_out).items():
        rows = np.flatnonzero(users == number)
        if len(rows) >= _LEAST_PX:
            border = Border.of(scene.cameras[view], scene.up, side)
            added = _mirrored(static.select(torch.from_numpy(rows)), border)
            free = unseen(added, scene.cameras)
            scene = scene.with_standing(added.select(torch.from_numpy(np.flatnonzero(free))))
    return scene


def _cut_off(geometry: Geometry, held_out: Bool[np.ndarray, " f"]) -> dict[int, tuple[int, int]]:
    """Road users that stand and that no view shows whole: the view that shows most of each, and the side."""
    assert geometry.road_users is not None
    most, left_out = dict[int, tuple[int, int, int]](), {0}
    for view in np.flatnonzero(~held_out).tolist():
        users = geometry.road_users[view]
        counts = np.bincount(users.ravel())
        moving = np.bincount(users.ravel(), weights=geometry.moving[view].ravel()) > _MOVES * counts
        cut = {-1: set(users[:, :_RIM_PX].flat), 1: set(users[:, -_RIM_PX:].flat)}
        for number in np.flatnonzero(counts >= _LEAST_PX).tolist():
            sides = [side for side, there in cut.items() if number in there]
            if moving[number] or not sides:
                left_out.add(number)
            most[number] = max(
                most.get(number, (0, 0, 0)), (int(counts[number]), view, sides[0] if sides else 0)
            )
    return {number: (view, side) for number, (_, view, side) in most.items() if number not in left_out}


def _mirrored(own: Gaussians, border: Border) -> Gaussians:
    """What a mirror in the border shows of a vehicle near it, marked as filled."""
    normal = border.aside - border.slope * border.ahead
    normal /= np.linalg.norm(normal)
    away = own.means.double().numpy() - border.place
    inside_m = -away @ normal
    near = np.linalg.norm(away, axis=1) < _NEAR_M
    rows = np.flatnonzero(near & (inside_m > 0) & (inside_m < _CLOSED_M))
    found = own.select(torch.from_numpy(rows))
    places = border.place + away[rows] + 2 * inside_m[rows, None] * normal
    return replace(
        found,
        means=torch.from_numpy(places).float(),
        quaternions=turned(found.quaternions.double().numpy(), normal),
        filled=torch.ones(len(found), dtype=torch.bool),
    )
