"""Cuboids of PandaSet as boxes on tracks, in the words of nuScenes."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.datasets.pandaset.restricted import BOXES
from dreamdrive.datasets.pandaset.tables import Columns, read_table
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import FARTHEST_M
from dreamdrive.scene.street.log import BoxTrack

CATEGORIES = {
    "Car": "vehicle.car",
    "Pickup Truck": "vehicle.truck",
    "Medium-sized Truck": "vehicle.truck",
    "Semi-truck": "vehicle.truck",
    "Towed Object": "vehicle.trailer",
    "Motorcycle": "vehicle.motorcycle",
    "Motorized Scooter": "vehicle.motorcycle",
    "Bicycle": "vehicle.bicycle",
    "Bus": "vehicle.bus.rigid",
    "Train": "vehicle.bus.rigid",
    "Trolley": "vehicle.bus.rigid",
    "Tram / Subway": "vehicle.bus.rigid",
    "Emergency Vehicle": "vehicle.emergency.police",
    "Other Vehicle - Construction Vehicle": "vehicle.construction",
    "Other Vehicle - Pedicab": "vehicle.bicycle",
    "Other Vehicle - Uncommon": "vehicle.car",
    "Personal Mobility Device": "human.pedestrian.personal_mobility",
    "Pedestrian": "human.pedestrian.adult",
    "Pedestrian with Object": "human.pedestrian.adult",
    "Animals - Bird": "animal",
    "Animals - Other": "animal",
    "Cones": "movable_object.trafficcone",
    "Construction Signs": "movable_object.barrier",
    "Temporary Construction Barriers": "movable_object.barrier",
    "Road Barriers": "static.manmade",
    "Pylons": "static.manmade",
    "Signs": "static.manmade",
    "Rolling Containers": "movable_object.pushable_pullable",
}
"""Category of nuScenes by label, both as their instructions for annotators say.

nuScenes counts pick-ups as trucks. It has no rail vehicles, which are buses here, and no uncommon vehicles
(tuk-tuks, street-sweepers), which are cars here. PandaSet does not tell which emergency vehicle it is. What
is fixed to the ground has the name that nuScenes gives its points."""
_CHILD = "human.pedestrian.child"
_MOTIONS = {
    "Moving": ("vehicle.moving", 1),
    "Stopped": ("vehicle.stopped", 0),
    "Parked": ("vehicle.parked", 0),
}
_BEHAVIOURS = {
    "Walking": ("pedestrian.moving", 1),
    "Standing": ("pedestrian.standing", 0),
    "Sitting": ("pedestrian.sitting_lying_down", 0),
    "Lying": ("pedestrian.sitting_lying_down", 0),
}
_RIDERS = {"With Rider": "cycle.with_rider", "Without Rider": "cycle.without_rider"}
_NEEDED = ("uuid", "label", "yaw", *(f"{of}.{axis}" for of in ("position", "dimensions") for axis in "xyz"))
_LARGEST_M = 1000.0
_FRONT_LIDAR = 1


@dataclass(frozen=True)
class _Cuboid:
    """A row of a table; ``size_m`` is width, length and height."""

    uuid: str
    label: str
    sensor: int
    sibling: str
    place_m: Float[np.ndarray, " 3"]
    size_m: Float[np.ndarray, " 3"]
    yaw: float
    stationary: bool | None
    told: Mapping[str, str]


def read_boxes(
    files: Mapping[int, Path], times_s: Mapping[int, float], problems: list[str]
) -> tuple[BoxTrack, ...]:
    """Boxes of all times on tracks.

    Things that move where both lidars see them are labelled twice, for each lidar at its own time. That of
    the front lidar is left out where there is the other one; else it is on the track of the other one.

    Args:
        files: Tables by the number of their sweep.
        times_s: Times of the sweeps.
        problems: Takes what is wrong, in sentences.
    """
    frames: dict[int, list[_Cuboid]] = {}
    for step, file in files.items():
        try:
            frames[step] = _rows(read_table(file, BOXES), file, problems)
        except InputError as error:
            problems.append(f"{error}: there are no boxes at that time")
    twins = _twins([cuboid for rows in frames.values() for cuboid in rows])
    tracks: dict[str, dict[int, _Cuboid]] = defaultdict(dict)
    for step, rows in sorted(frames.items()):
        for cuboid in sorted(rows, key=lambda each: each.sensor == _FRONT_LIDAR):
            tracks[twins.get(cuboid.uuid, cuboid.uuid)].setdefault(step, cuboid)
    unknown = sorted({next(iter(track.values())).label for track in tracks.values()} - CATEGORIES.keys())
    if unknown:
        problems.append(
            f"labels are not known and their boxes left out: {', '.join(unknown)[:300]}; expected those of "
            "PandaSet"
        )
    return tuple(made for uuid, track in tracks.items() if (made := _track(uuid, track, times_s)) is not None)


def _twins(cuboids: Sequence[_Cuboid]) -> dict[str, str]:
    """Of what the front lidar saw, the names of the same things in the other one; each may name the other."""
    front = {each.uuid for each in cuboids if each.sensor == _FRONT_LIDAR}
    others = {each.uuid for each in cuboids} - front
    found = {each.sibling: each.uuid for each in cuboids if each.uuid in others and each.sibling in front}
    return found | {
        each.uuid: each.sibling for each in cuboids if each.uuid in front and each.sibling in others
    }


def _rows(table: Columns, file: Path, problems: list[str]) -> list[_Cuboid]:
    """The rows of a table whose numbers are those of a box."""
    missing = [name for name in _NEEDED if name not in table]
    if missing:
        raise InputError(f"{file} has no columns {', '.join(missing)}; expected cuboids of PandaSet")
    count = len(table["uuid"])
    places, sizes = (
        np.column_stack([_numbers(table, f"{of}.{axis}", file) for axis in "xyz"])
        for of in ("position", "dimensions")
    )
    yaws = _numbers(table, "yaw", file)
    sensors = (
        _numbers(table, "cuboids.sensor_id", file) if "cuboids.sensor_id" in table else np.full(count, -1)
    )
    whole = (np.abs(places) <= FARTHEST_M).all(axis=1) & (np.abs(yaws) <= FARTHEST_M)
    whole &= ((sizes > 0) & (sizes <= _LARGEST_M)).all(axis=1)
    if not whole.all():
        problems.append(f"{file.name}: {(~whole).sum()} cuboids have no usable numbers and are left out")
    told = {name.removeprefix("attributes."): table[name] for name in table if name.startswith("attributes.")}
    return [
        _Cuboid(
            uuid=str(table["uuid"][row]),
            label=str(table["label"][row]),
            sensor=int(sensors[row]) if np.isfinite(sensors[row]) else -1,
            sibling=str(table["cuboids.sibling_id"][row]) if "cuboids.sibling_id" in table else "",
            place_m=places[row],
            size_m=sizes[row],
            yaw=float(yaws[row]),
            stationary=bool(table["stationary"][row]) if "stationary" in table else None,
            told={name: value for name, column in told.items() if isinstance(value := column[row], str)},
        )
        for row in np.flatnonzero(whole)
    ]


def _numbers(table: Columns, name: str, file: Path) -> Float[np.ndarray, " n"]:
    try:
        return table[name].astype(np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{file}: the column {name} holds what is no number") from None


def _track(uuid: str, track: Mapping[int, _Cuboid], times_s: Mapping[int, float]) -> BoxTrack | None:
    rows = list(track.values())
    category = CATEGORIES.get(rows[0].label)
    if category is None:
        return None
    if category == "human.pedestrian.adult" and any(
        row.told.get("pedestrian_age") == "Child" for row in rows
    ):
        category = _CHILD
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    # Yaw 0 looks along y, the length of a cuboid.
    yaws = np.array([row.yaw for row in rows]) + np.pi / 2
    poses[:, :3, :3] = Rotation.from_euler("z", yaws[:, None]).as_matrix()
    poses[:, :3, 3] = [row.place_m for row in rows]
    told = [_told(row) for row in rows]
    return BoxTrack(
        id=uuid,
        category=category,
        times_s=np.array([times_s[step] for step in track]),
        world_from_box=poses,
        size_lwh_m=np.array([row.size_m for row in rows])[:, [1, 0, 2]],
        visibility=np.zeros(len(rows), int),
        moves=np.array([moves for _, moves in told]),
        lidar_points=np.full(len(rows), -1),
        attributes=tuple(names for names, _ in told),
    )


def _told(cuboid: _Cuboid) -> tuple[tuple[str, ...], int]:
    """Attributes in the words of nuScenes, and whether it moves, as ``BoxTrack.moves`` counts."""
    names: list[str] = []
    moves = {True: 0, False: 1, None: -1}[cuboid.stationary]
    for key, words in (("object_motion", _MOTIONS), ("pedestrian_behavior", _BEHAVIOURS)):
        if (value := cuboid.told.get(key)) in words:
            name, moves = words[value]
            names.append(name)
    rider = _RIDERS.get(cuboid.told.get("rider_status", ""))
    return tuple(names) if rider is None else (rider,), moves
