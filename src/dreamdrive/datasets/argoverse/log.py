"""A sensor log of Argoverse 2 as a log: path of the car, boxes on tracks, vector map; no pictures, no lidar.

Boxes are in the frame of the car at their time: x ahead, y left, z up, with the origin in the middle of the
rear axle, ``AXLE_M`` above the road.
"""

import re
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from dreamdrive.datasets.argoverse.maps import find_maps, read_map
from dreamdrive.datasets.argoverse.tables import Columns, find_table, read_table
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import FARTHEST_M
from dreamdrive.scene.street.log import BoxTrack, Log, LogMap
from dreamdrive.scene.trajectory import Trajectory

AXLE_M = 0.33
"""Of the rear axle above the road: the borders of lanes within 8 m of the car lie 0.29 to 0.36 m below it in
the log adcf7d18."""
CATEGORIES = {
    "REGULAR_VEHICLE": "vehicle.car",
    "LARGE_VEHICLE": "vehicle.truck",
    "TRUCK": "vehicle.truck",
    "BOX_TRUCK": "vehicle.truck",
    "TRUCK_CAB": "vehicle.truck",
    "BUS": "vehicle.bus.rigid",
    "SCHOOL_BUS": "vehicle.bus.rigid",
    "ARTICULATED_BUS": "vehicle.bus.bendy",
    "RAILED_VEHICLE": "vehicle.bus.rigid",
    "VEHICULAR_TRAILER": "vehicle.trailer",
    "MESSAGE_BOARD_TRAILER": "vehicle.trailer",
    "TRAFFIC_LIGHT_TRAILER": "vehicle.trailer",
    "MOTORCYCLE": "vehicle.motorcycle",
    "MOTORCYCLIST": "vehicle.motorcycle",
    "BICYCLE": "vehicle.bicycle",
    "BICYCLIST": "vehicle.bicycle",
    "WHEELED_DEVICE": "human.pedestrian.personal_mobility",
    "WHEELED_RIDER": "human.pedestrian.personal_mobility",
    "WHEELCHAIR": "human.pedestrian.wheelchair",
    "STROLLER": "human.pedestrian.stroller",
    "PEDESTRIAN": "human.pedestrian.adult",
    "OFFICIAL_SIGNALER": "human.pedestrian.adult",
    "DOG": "animal",
    "ANIMAL": "animal",
    "CONSTRUCTION_CONE": "movable_object.trafficcone",
    "CONSTRUCTION_BARREL": "movable_object.barrier",
    "MOBILE_PEDESTRIAN_CROSSING_SIGN": "movable_object.barrier",
    "MOBILE_PEDESTRIAN_SIGN": "movable_object.barrier",
    "BOLLARD": "static.manmade",
    "SIGN": "static.manmade",
    "STOP_SIGN": "static.manmade",
}
"""Category of nuScenes by label, as the descriptions of both say.

Argoverse counts pick-ups as regular vehicles, which are cars here and trucks in nuScenes, and motor homes and
fire engines as large vehicles, which are trucks here. nuScenes has no rail vehicles, which are buses here.
Who rides is labelled beside what is ridden; both have the name of the vehicle, which in nuScenes holds its
rider. Children are not told from adults, nor who directs traffic from others. What is fixed to the ground has
the name that nuScenes gives its points."""
_POSES, _BOXES = "city_SE3_egovehicle", "annotations"
_TURN, _PLACE = ("qw", "qx", "qy", "qz"), ("tx_m", "ty_m", "tz_m")
_POSE = {"timestamp_ns": int, **dict.fromkeys((*_TURN, *_PLACE), float)}
_SIZE = ("length_m", "width_m", "height_m")
_BOX = {
    **{"track_uuid": str, "category": str, "num_interior_pts": int},
    **_POSE,
    **dict.fromkeys(_SIZE, float),
}
_LARGEST_M = 1000.0
_EGO_FROM_ROAD = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -AXLE_M], [0, 0, 0, 1]])
_CITY = re.compile(r"____([A-Z]+)_city_")
_NOTES = (
    f"Argoverse has the poses of the rear axle: the car is taken {AXLE_M} m below them, on the road.",
    "Argoverse's clock tells no date: microseconds are as in its tables.",
    "Pictures and lidar of Argoverse are not read.",
)


def is_argoverse(folder: Path) -> bool:
    """Whether a folder is that of a sensor log of Argoverse 2, by its tables."""
    return all(find_table(folder, name) is not None for name in (_POSES, _BOXES))


def read_argoverse(folder: Path) -> Log:
    """A sensor log by its folder: the tables of poses and annotations, and ``map/log_map_archive_*.json``.

    Tables are feather as downloaded, for which pyarrow has to be installed, or CSV. The world is that of the
    city. Times that are labelled are those of the lidar, ten a second. A map that is missing or damaged is in
    ``problems``, and the rest works.

    Raises:
        InputError: A table is missing or damaged, lacks a column, or tells no pose of the car.
    """
    folder = folder.absolute()
    boxes = read_table(folder, _BOXES, _BOX)
    stamps_ns = np.unique(boxes["timestamp_ns"])
    if not len(stamps_ns):
        raise InputError(
            f"{folder}: the table {_BOXES} is empty; expected a log with labels: take another one"
        )
    start_ns = int(stamps_ns[0])
    times_s = (stamps_ns - start_ns) / 1e9
    world_from_axle = _axle(folder, start_ns)
    first_s, last_s = float(world_from_axle.times_s[0]), float(world_from_axle.times_s[-1])
    if times_s[0] < first_s or times_s[-1] > last_s:
        raise InputError(
            f"{folder}: {_BOXES} lasts from 0 to {times_s[-1]:g} s, and {_POSES} from {first_s:g} to "
            f"{last_s:g} s; expected poses at all times of boxes: the tables are of two logs, or cut short"
        )
    problems: list[str] = []
    map, location = _map(folder, problems)
    return Log(
        name=folder.name,
        about="",
        location=location,
        root=folder.parent,
        cameras=(),
        times_s=times_s,
        start_us=start_ns // 1000,
        world_from_ego=world_from_axle.at(times_s) @ _EGO_FROM_ROAD,
        boxes=_boxes(boxes, world_from_axle, start_ns, problems),
        map=map,
        notes=_NOTES,
        problems=tuple(problems),
    )


def _axle(folder: Path, start_ns: int) -> Trajectory:
    """Poses of the rear axle in the world, on the clock of the log."""
    table = read_table(folder, _POSES, _POSE)
    file = find_table(folder, _POSES)
    good = _usable(table)
    if not len(good) or not good.all():
        row = f"row {int(good.argmin()) + 1}" if len(good) else "it is empty"
        raise InputError(
            f"{file}: {row}: expected finite places in metres and quaternions of length 1; download it again"
        )
    order = np.argsort(table["timestamp_ns"], kind="stable")
    stamps_ns = table["timestamp_ns"][order]
    new = np.concatenate([[True], np.diff(stamps_ns) > 0])
    try:
        return Trajectory(_poses(table)[order][new], (stamps_ns[new] - start_ns) / 1e9)
    except ValueError as error:
        raise InputError(f"{file}: {error}; download it again") from None


def _columns(table: Columns, names: tuple[str, ...]) -> Float[np.ndarray, "n k"]:
    return np.column_stack([table[name] for name in names])


def _usable(table: Columns) -> Bool[np.ndarray, " n"]:
    """Which rows have finite places and quaternions of length 1."""
    turns, places = _columns(table, _TURN), _columns(table, _PLACE)
    lengths = np.linalg.norm(np.clip(turns, -2, 2), axis=1)
    near = np.abs(places).max(axis=1, initial=0) <= FARTHEST_M / 2
    return np.asarray(near & (np.abs(lengths - 1) < 1e-3))


def _poses(table: Columns) -> Float[np.ndarray, "n 4 4"]:
    poses = np.tile(np.eye(4), (len(table["qw"]), 1, 1))
    poses[:, :3, :3] = Rotation.from_quat(_columns(table, _TURN), scalar_first=True).as_matrix()
    poses[:, :3, 3] = _columns(table, _PLACE)
    return poses


def _boxes(
    table: Columns, world_from_axle: Trajectory, start_ns: int, problems: list[str]
) -> tuple[BoxTrack, ...]:
    sizes_m = _columns(table, _SIZE)
    good = _usable(table) & np.asarray(((sizes_m > 0) & (sizes_m <= _LARGEST_M)).all(axis=1))
    if not good.all():
        problems.append(f"{_BOXES}: {(~good).sum()} boxes have no usable numbers and are left out")
    known = np.array([category in CATEGORIES for category in table["category"].tolist()], bool)
    if not known.all():
        names = sorted(set(table["category"][~known].tolist()))
        problems.append(
            f"{_BOXES}: categories are not known and their boxes left out: {', '.join(names)[:300]}; "
            "expected those of Argoverse 2"
        )
    kept = {name: column[good & known] for name, column in table.items()}
    times_s = (kept["timestamp_ns"] - start_ns) / 1e9
    world_from_box = world_from_axle.at(times_s) @ _poses(kept)
    order = np.lexsort((times_s, kept["track_uuid"]))
    starts = np.flatnonzero(kept["track_uuid"][order][1:] != kept["track_uuid"][order][:-1]) + 1
    tracks = [rows for rows in np.split(order, starts) if len(rows)]
    single = [rows[np.concatenate([[True], np.diff(times_s[rows]) > 0])] for rows in tracks]
    if sum(map(len, single)) < len(order):
        problems.append(f"{_BOXES}: boxes are labelled twice at one time; the first of each counts")
    return tuple(_track(kept, rows, times_s[rows], world_from_box[rows]) for rows in single)


def _track(
    table: Columns,
    rows: Int[np.ndarray, " k"],
    times_s: Float[np.ndarray, " k"],
    world_from_box: Float[np.ndarray, "k 4 4"],
) -> BoxTrack:
    return BoxTrack(
        id=str(table["track_uuid"][rows[0]]),
        category=CATEGORIES[str(table["category"][rows[0]])],
        times_s=times_s,
        world_from_box=world_from_box,
        size_lwh_m=_columns(table, _SIZE)[rows],
        visibility=np.zeros(len(rows), int),
        moves=np.full(len(rows), -1),
        lidar_points=table["num_interior_pts"][rows],
        attributes=((),) * len(rows),
    )


def _map(folder: Path, problems: list[str]) -> tuple[LogMap, str]:
    """The map and the city; empty where they are not known, which is said."""
    files = find_maps(folder)
    if len(files) != 1:
        names = ", ".join(file.name for file in files) or "none"
        problems.append(f"{folder}: expected one map/log_map_archive_*.json, found {names}: there is no map")
        return LogMap(), ""
    city = _CITY.search(files[0].name)
    location = "" if city is None else city[1]
    try:
        return read_map(files[0], problems), location
    except InputError as error:
        problems.append(f"{error}: there is no map")
        return LogMap(), location
