"""A scene made complete on both sides of its path."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool

from dreamdrive.complete.borders import beyond_borders
from dreamdrive.complete.holes import without_holes
from dreamdrive.complete.mirror import road_user_of
from dreamdrive.complete.vehicles import with_vehicles_closed
from dreamdrive.compute.device import CPU
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene


@dataclass(frozen=True)
class CompletionOptions:
    """What is put where no frame saw anything.

    Attributes:
        aside_m: How far aside views are complete, to both sides; 0 completes nothing.
        step_m: Between the views that holes are looked for in.
        views: Recorded views that are looked at from aside, spread over the drive.
        ahead_m: Length of street beyond a picture's border that is made of what lies inside of it.
    """

    aside_m: float = 3.0
    step_m: float = 1.0
    views: int = 5
    ahead_m: float = 9.0


def completed(
    scene: Scene, geometry: Geometry, options: CompletionOptions, device: torch.device = CPU
) -> Scene:
    """The scene with what views aside of its path would meet and no frame saw, marked as filled.

    Vehicles that the border of all pictures cuts off are closed there. What else a border cuts off goes on as
    what lies inside of it, mirrored along the road; then holes that are left are filled from around, from
    views in steps outwards. What moves is no part of it. A street that moves per frame stays as it is. Views
    are drawn on ``device``.
    """
    if not options.aside_m or not len(scene.static) or scene.moves_per_frame:
        return scene
    chosen = _chosen(scene, options.views)
    bare = replace(scene, static=scene.static.without_features())  # or each addition would copy them
    made = with_vehicles_closed(bare, geometry)
    users = torch.ones(len(made.static), dtype=torch.bool)
    users[: len(bare.static)] = torch.from_numpy(road_user_of(bare.static, geometry) > 0)
    made = beyond_borders(made, geometry, chosen, options.ahead_m)
    count = round(options.aside_m / options.step_m)
    shifts_m = [side * options.step_m * k for k in range(1, count + 1) for side in (1, -1)]
    made = without_holes(made, geometry, chosen, shifts_m, users, device)
    added = torch.arange(len(scene.static), len(made.static))
    return scene.with_standing(made.static.select(added)) if len(added) else scene


def _chosen(scene: Scene, count: int) -> list[int]:
    """Views that may be seen, of all cameras alike, spread over the drive, its first and last among them."""
    seen: Bool[np.ndarray, " f"] = ~scene.held_out
    rig = np.zeros(len(seen), int) if scene.camera is None else scene.camera
    each = max(2, count // len(np.unique(rig)))
    chosen: list[int] = []
    for camera in np.unique(rig):
        views = np.flatnonzero(seen & (rig == camera))
        chosen += views[np.unique(np.linspace(0, len(views) - 1, each).round().astype(int))].tolist()
    return chosen
