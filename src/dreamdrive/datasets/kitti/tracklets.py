"""``tracklet_labels.xml`` of KITTI's raw drives: boxes on tracks.

A place is the middle of a box's lower side in the frame of the lidar; x of the box is its length.
"""

from collections.abc import Mapping
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.datasets.kitti.files import Pose
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes
from dreamdrive.scene.street.log import BoxTrack

TRACKLETS = "tracklet_labels.xml"
CATEGORIES = {
    "Car": "vehicle.car",
    "Van": "vehicle.car",
    "Truck": "vehicle.truck",
    "Tram": "vehicle.bus.rigid",
    "Cyclist": "vehicle.bicycle",
    "Pedestrian": "human.pedestrian.adult",
    "Person (sitting)": "human.pedestrian.adult",
    "Person_sitting": "human.pedestrian.adult",
}
"""Category of nuScenes by type. nuScenes counts vans as cars, and has no trams, which are buses here.

``Misc`` of KITTI may be a trailer as well as a scooter, and has none."""
_ATTRIBUTES = {
    "Cyclist": ("cycle.with_rider",),
    "Person (sitting)": ("pedestrian.sitting_lying_down",),
    "Person_sitting": ("pedestrian.sitting_lying_down",),
}
_SEEN = {"0": 4, "2": 1}
"""Visibility of what is not occluded, and of what is largely so; of what is partly so it is not known."""
_MOST_BYTES = 32_000_000
_LARGEST_M = 1000.0
_LARGEST = 1e5


def read_tracklets(
    path: Path, times_s: Mapping[int, float], world_from_lidar: Mapping[int, Pose], problems: list[str]
) -> tuple[BoxTrack, ...]:
    """Boxes at the times whose poses are known; others are left out.

    Args:
        path: The file.
        times_s: Of each frame.
        world_from_lidar: Of each frame.
        problems: Takes what is wrong with single tracks, in sentences.

    Raises:
        InputError: The file is no such list, cut off, or declares entities.
    """
    tracks: list[BoxTrack] = []
    unknown: set[str] = set()
    for number, item in enumerate(_parsed(path).findall("tracklets/item")):
        kind = item.findtext("objectType", "").strip()
        if kind not in CATEGORIES:
            unknown.add(kind[:80])
            continue
        try:
            track = _track(f"tracklet-{number}", kind, item, times_s, world_from_lidar)
        except ValueError as error:
            problems.append(f"{path.name}: tracklet {number} is left out: {error}")
            continue
        if track is not None:
            tracks.append(track)
    if unknown:
        problems.append(
            f"{path.name}: types have no category of nuScenes and their boxes are left out: "
            f"{', '.join(sorted(unknown))[:300]}"
        )
    return tuple(tracks)


def _parsed(path: Path) -> Element:
    """The tree of a file without entities, with which a short file could fill the memory or read others."""
    data = read_bytes(path, at_most=_MOST_BYTES)
    builder = TreeBuilder()
    parser = expat.ParserCreate()

    def refuse(*_: object) -> int:
        raise InputError(f"{path} declares entities, which KITTI's tracklets have not; download it again")

    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = refuse
    parser.UnparsedEntityDeclHandler = refuse
    parser.ExternalEntityRefHandler = refuse
    try:
        parser.Parse(data, True)
        return builder.close()
    except InputError:
        raise
    except (expat.ExpatError, AssertionError, LookupError, ValueError) as error:
        raise InputError(f"{path} is damaged or cut off ({error}); download it again") from None


def _track(
    name: str,
    kind: str,
    item: Element,
    times_s: Mapping[int, float],
    world_from_lidar: Mapping[int, Pose],
) -> BoxTrack | None:
    """One track; None where it has no box at a known time."""
    size = np.array([_number(item, side) for side in "lwh"])
    if not ((size > 0) & (size <= _LARGEST_M)).all():
        raise ValueError(f"its size is {size.tolist()}; expected positive metres")
    first = int(_number(item, "first_frame"))
    poses = [
        (step, pose)
        for step, pose in enumerate(item.findall("poses/item"), start=first)
        if step in world_from_lidar and step in times_s
    ]
    if not poses:
        return None
    boxes = [world_from_lidar[step] @ _lidar_from_box(pose, size) for step, pose in poses]
    return BoxTrack(
        id=name,
        category=CATEGORIES[kind],
        times_s=np.array([times_s[step] for step, _ in poses]),
        world_from_box=np.stack(boxes),
        size_lwh_m=np.tile(size, (len(poses), 1)),
        visibility=np.array([_SEEN.get(pose.findtext("occlusion", "").strip(), 0) for _, pose in poses]),
        moves=np.full(len(poses), -1),
        lidar_points=np.full(len(poses), -1),
        attributes=(_ATTRIBUTES.get(kind, ()),) * len(poses),
    )


def _lidar_from_box(pose: Element, size_lwh_m: Float[np.ndarray, " 3"]) -> Pose:
    turn = Rotation.from_euler("xyz", [_number(pose, f"r{axis}") for axis in "xyz"]).as_matrix()
    made = np.eye(4)
    made[:3, :3] = turn
    made[:3, 3] = [_number(pose, f"t{axis}") for axis in "xyz"] + turn[:, 2] * size_lwh_m[2] / 2
    return made


def _number(of: Element, name: str) -> float:
    text = of.findtext(name, "")
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"{name} is {text[:40]!r}; expected a number") from None
    if not abs(value) <= _LARGEST:
        raise ValueError(f"{name} is {value:g}; expected at most {_LARGEST:g}")
    return value
