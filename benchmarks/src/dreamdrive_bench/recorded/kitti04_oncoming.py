"""The oncoming cars of the KITTI 04 clip, and how many of them a scene has as things that approach.

The list was made by hand: every frame was looked at, enlarged, and the boxes were read from the enlarged
pictures, to about 2 px. Cars that stand beside the road, the van ahead and what mirrors show are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dreamdrive.scene.actor import Actor
from dreamdrive.scene.scene import Scene

CLIP = "kitti_odom04_follow_van"
SIZE = (1226, 370)
"""Width and height of the recorded frames, in whose pixels the boxes are."""
LEAST_HEIGHT_PX = 12.0
"""Of the largest view of a car, at the size of the run; smaller ones are listed and not judged, as with
PandaSet."""
APPROACHES_M_S = -2.0
"""Forward speed in the world below which a thing comes towards the camera; what stands has 0."""
_LEAST_OVERLAP = 0.25  # intersection over union of the listed box and that of an actor's Gaussians
_OUTER = 0.02  # share of these that lie outside their box, at each side

Box = tuple[float, float, float, float]
"""First column and row, last column and row."""


@dataclass(frozen=True)
class OncomingCar:
    """One car: the first and the last frame of the recording that show it, and its box in some of them."""

    name: str
    first: int
    last: int
    boxes: dict[int, Box]


CARS = (
    OncomingCar(
        "white hatchback", 0, 5, {0: (284, 186, 369, 236), 2: (160, 191, 295, 259), 4: (0, 202, 149, 307)}
    ),
    OncomingCar(
        "dark saloon",
        0,
        23,
        {
            0: (512, 177, 531, 190),
            4: (495, 178, 519, 193),
            8: (469, 178, 500, 198),
            12: (427, 180, 471, 207),
            16: (350, 186, 419, 225),
            18: (277, 188, 374, 238),
            20: (150, 190, 305, 260),
            22: (0, 204, 179, 308),
        },
    ),
    OncomingCar("distant white car", 36, 50, {42: (569, 171, 576, 177), 46: (565, 171, 573, 177)}),
)
"""All that come towards the camera in frames 0 to 50. The third is 7 to 9 px wide."""


def figures(scene: Scene, source_index: Sequence[int]) -> dict:
    """How many of the cars became actors that approach, which of them, and what the others became.

    ``source_index`` has for each view of the scene its frame in the recording.
    """
    width, height = scene.cameras[0].width_px, scene.cameras[0].height_px
    scale = np.array([width / SIZE[0], height / SIZE[1]] * 2)
    judged = [car for car in CARS if _tallest_px(car, scale) >= LEAST_HEIGHT_PX]
    told = {car.name: _told(scene, list(source_index), car, scale) for car in judged}
    return {
        "oncoming_listed": len(CARS),
        "oncoming_judged": len(judged),
        "oncoming_approaching": sum(one == "approaches" for one in told.values()),
        "oncoming": told | {car.name: "too small to judge" for car in CARS if car not in judged},
    }


def _tallest_px(car: OncomingCar, scale: np.ndarray) -> float:
    return max((box[3] - box[1]) * scale[3] for box in car.boxes.values())


def _told(scene: Scene, source_index: list[int], car: OncomingCar, scale: np.ndarray) -> str:
    """``approaches``, or in words what the scene has in the car's place."""
    shown = [frame for frame in car.boxes if frame in source_index]
    views = {source_index.index(frame): np.array(car.boxes[frame]) * scale for frame in shown}
    if not views:
        return "missed: none of its listed frames is in the run"
    overlaps = {a.id: [_overlap(scene, a, view, box) for view, box in views.items()] for a in scene.actors}
    # Most of the frames: an actor that crosses the box once is another one.
    own = [a for a in scene.actors if 2 * sum(o >= _LEAST_OVERLAP for o in overlaps[a.id]) >= len(views)]
    if not own:
        return "missed: no actor where it is"
    best = max(own, key=lambda actor: float(np.mean(overlaps[actor.id])))
    speed_m_s = forward_m_s(scene, best, list(views))
    if speed_m_s < APPROACHES_M_S:
        return "approaches"
    return f"missed: {best.name} is where it is, but goes forward at {speed_m_s:.1f} m/s"


def forward_m_s(scene: Scene, actor: Actor, views: Sequence[int]) -> float:
    """Median speed of an actor in the world along the axis of the camera, at some of the views."""
    speeds = []
    for view in views:
        around_s = scene.times_s[view] + np.array([-0.05, 0.05])
        way_m = np.diff(actor.track.at(around_s).positions_m, axis=0)[0]
        speeds.append(way_m @ scene.cameras[view].world_from_camera[:3, 2] / np.ptp(around_s))
    return float(np.median(speeds))


def _overlap(scene: Scene, actor: Actor, view: int, box: np.ndarray) -> float:
    """Intersection over union of a box and the one around an actor's living Gaussians in a view."""
    living = scene.dynamic_at(float(scene.times_s[view]))
    if living.actor is None:
        return 0.0
    own = living.means[living.actor == actor.id].numpy().astype(np.float64)
    shown = scene.cameras[view].project(own)
    shown = shown[scene.cameras[view].shows(shown), :2]
    if not len(shown):
        return 0.0
    low, high = np.quantile(shown, [_OUTER, 1 - _OUTER], axis=0)
    common = np.prod(np.maximum(np.minimum(high, box[2:]) - np.maximum(low, box[:2]), 0))
    return float(common / (np.prod(high - low) + np.prod(box[2:] - box[:2]) - common))
