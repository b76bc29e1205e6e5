"""The layout of a log: its map, boxes on tracks and path, as a map-conditioned prior takes them."""

from math import atan, atan2

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.street.layout import (
    Area,
    AreaKind,
    Box,
    BoxKind,
    Ego,
    Layout,
    Lens,
    Line,
    LineKind,
    TrackPoint,
)
from dreamdrive.scene.street.log import BoxTrack, Log, LogCamera, Polygon, word_of

REACH_M = 120.0
"""How far from the drive a layout goes: beyond the end of sight of a map-conditioned prior."""
KINDS: dict[str, BoxKind] = {
    "vehicle.car": "car",
    "vehicle.emergency.police": "car",
    "vehicle.emergency.ambulance": "van",
    "vehicle.truck": "truck",
    "vehicle.trailer": "truck",
    "vehicle.construction": "truck",
    "vehicle.bus": "bus",
    "vehicle.motorcycle": "motorcycle",
    "vehicle.bicycle": "bicycle",
    "human": "pedestrian",
}
"""What boxes of a category are in a layout, by the beginning of its name; others are left out."""
AREAS: dict[str, AreaKind] = {
    "walkway": "sidewalk",
    "carpark_area": "parking",
    "drivable_area": "road",
    "ped_crossing": "crossing",
}
"""What areas of a layer are in a layout, in the order in which they lie on one another."""
LINES: dict[str, LineKind] = {"lane_divider": "lane_divider", "road_divider": "road_divider"}
_STILL_M = 0.5
"""Labels of what stands wander by a few decimetres."""


def layout_of_log(log: Log) -> Layout:
    """The street of a drive, from above.

    The origin is the car's first place, and time 0 that of the first label. What is labelled at some times
    only goes on as a layout has it: at its last speed.
    """
    origin = log.world_from_ego[0, :2, 3]
    low, high = log.world_from_ego[:, :2, 3].min(0) - REACH_M, log.world_from_ego[:, :2, 3].max(0) + REACH_M
    within = np.stack([low, high])
    camera = log.cameras[0]
    areas: list[Area] = []
    for layer, kind in AREAS.items():
        areas += [
            made for each in log.map.areas.get(layer, ()) if (made := _area(each, kind, within, origin))
        ]
    lines = [
        Line(kind, _points(points[inside], origin))
        for layer, kind in LINES.items()
        for points in log.map.lines.get(layer, ())
        if (inside := ((points >= low) & (points <= high)).all(axis=1)).sum() > 1
    ]
    return Layout(
        ego=Ego(
            _ego_track(camera, log, origin), camera_height_m=max(0.1, float(camera.ego_from_camera[2, 3]))
        ),
        areas=areas,
        lines=lines,
        boxes=_boxes(log, origin),
        lens=_lens(camera),
    )


def kind_of(category: str) -> BoxKind | None:
    """What a thing of a category is in a layout; None for what is no road user."""
    return word_of(category, KINDS)


def clipped(ring: Float[np.ndarray, "n 2"], within: Float[np.ndarray, "2 2"]) -> Float[np.ndarray, "_ 2"]:
    """The part of a polygon inside a rectangle (Sutherland and Hodgman 1974); parts may hang together."""
    for axis in (0, 1):
        for bound, sign in ((within[0, axis], 1.0), (within[1, axis], -1.0)):
            if not len(ring):
                return ring
            inside = sign * (ring[:, axis] - bound)
            following = np.roll(inside, -1)
            made: list[Float[np.ndarray, " 2"]] = []
            for k, (here, there) in enumerate(zip(inside, following, strict=True)):
                if here >= 0:
                    made.append(ring[k])
                if (here >= 0) != (there >= 0):
                    made.append(ring[k] + here / (here - there) * (ring[(k + 1) % len(ring)] - ring[k]))
            ring = np.array(made).reshape(-1, 2)
    return ring


def _area(
    polygon: Polygon, kind: AreaKind, within: Float[np.ndarray, "2 2"], origin: Float[np.ndarray, " 2"]
) -> Area | None:
    outline = clipped(polygon.outline, within)
    if len(outline) < 3:
        return None
    holes = [clipped(hole, within) for hole in polygon.holes]
    return Area(kind, _points(outline, origin), [_points(hole, origin) for hole in holes if len(hole) > 2])


def _points(places: Float[np.ndarray, "n 2"], origin: Float[np.ndarray, " 2"]) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in np.round(places - origin, 3)]


def _ego_track(camera: LogCamera, log: Log, origin: Float[np.ndarray, " 2"]) -> list[TrackPoint]:
    """The path of the first camera at the labelled times."""
    poses = log.world_from_ego @ camera.ego_from_camera
    return [
        _point(t, pose[:2, 3] - origin, ego)
        for t, pose, ego in zip(log.times_s, poses, log.world_from_ego, strict=True)
    ]


def _point(t_s: float, place: Float[np.ndarray, " 2"], pose: Float[np.ndarray, "4 4"]) -> TrackPoint:
    return TrackPoint(float(t_s), float(place[0]), float(place[1]), atan2(pose[1, 0], pose[0, 0]))


def _boxes(log: Log, origin: Float[np.ndarray, " 2"]) -> list[Box]:
    """Road users, named by what they are and a number: tokens of data sets tell nobody anything."""
    made: list[Box] = []
    for track in log.boxes:
        kind = kind_of(track.category)
        if kind is not None:
            made.append(_box(track, kind, f"{kind}-{len(made) + 1}", origin))
    return made


def _box(track: BoxTrack, kind: BoxKind, name: str, origin: Float[np.ndarray, " 2"]) -> Box:
    places = track.world_from_box[:, :2, 3] - origin
    still = not (track.moves == 1).any() and np.ptp(places, axis=0).max() < _STILL_M
    rows = [len(places) // 2] if still else range(len(places))
    points = [_point(track.times_s[row], places[row], track.world_from_box[row]) for row in rows]
    length, width, height = np.median(track.size_lwh_m, axis=0).tolist()
    return Box(name, kind, (length, width, height), points)


def _lens(camera: LogCamera) -> Lens:
    pinhole, ahead = camera.pinhole, camera.ego_from_camera[:3, 2]
    hfov_rad = 2 * atan(pinhole.width_px / 2 / pinhole.fx_px)
    return Lens(hfov_rad=hfov_rad, pitch_rad=-atan2(float(ahead[2]), float(np.hypot(*ahead[:2]))))
