"""Logs: drives of data sets, with what was seen, labelled, measured and mapped.

World of a log: that of the data set, z up, in metres. The ego frame is x ahead, y left, z up, on the ground.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera, check_rigid

Word = TypeVar("Word", bound=str)
_NEAR_S = 0.05
"""How far from a label its time still is."""
_ABOUT_RAD = 2.0
"""Nothing turns so far from one label to the next."""


@dataclass(frozen=True)
class LogCamera:
    """The pictures of one camera, which are rectified, in the order of time.

    Attributes:
        name: As the data set calls it, such as ``CAM_FRONT``.
        files: The pictures.
        times_s: On the clock of the log.
        world_from_camera: Axes of the camera are x right, y down, z ahead.
        ego_from_camera: Its mounting.
        pinhole: At the size of the pictures.
        key: Which pictures are of a time that is labelled.
    """

    name: str
    files: tuple[Path, ...]
    times_s: Float[np.ndarray, " n"]
    world_from_camera: Float[np.ndarray, "n 4 4"]
    ego_from_camera: Float[np.ndarray, "4 4"]
    pinhole: Camera
    key: Bool[np.ndarray, " n"]

    def __post_init__(self) -> None:
        check_rigid(self.world_from_camera, f"poses of {self.name}")
        check_rigid(self.ego_from_camera, f"mounting of {self.name}")

    def __len__(self) -> int:
        return len(self.files)


@dataclass(frozen=True)
class BoxTrack:
    """A labelled thing at the times it was labelled.

    Attributes:
        id: Unique in the log.
        category: In the words of nuScenes, such as ``vehicle.car``.
        times_s: On the clock of the log.
        world_from_box: The origin is the middle of the box; x ahead, y left, z up.
        size_lwh_m: Length, width and height.
        visibility: Share that all cameras together see: 1 below 40 %, 2 to 60, 3 to 80, 4 above; 0 unknown.
        moves: 1 moving, 0 at rest, -1 unknown.
        lidar_points: How many points of lidar lie in it; -1 unknown.
        attributes: All that is told of it in words, such as ``vehicle.parked``.
    """

    id: str
    category: str
    times_s: Float[np.ndarray, " n"]
    world_from_box: Float[np.ndarray, "n 4 4"]
    size_lwh_m: Float[np.ndarray, "n 3"]
    visibility: Int[np.ndarray, " n"]
    moves: Int[np.ndarray, " n"]
    lidar_points: Int[np.ndarray, " n"]
    attributes: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        check_rigid(self.world_from_box, f"boxes of {self.id}")

    def pose_at(self, time_s: float) -> Float[np.ndarray, "4 4"] | None:
        """Where it is at a time, in between its labels; None before the first and after the last."""
        times_s = self.times_s
        if not times_s[0] - _NEAR_S <= time_s <= times_s[-1] + _NEAR_S:
            return None
        after = int(np.searchsorted(times_s, time_s))
        if after in (0, len(times_s)):
            return self.world_from_box[min(after, len(times_s) - 1)]
        one, other = self.world_from_box[after - 1 : after + 1]
        first, last = one[:3, 3], other[:3, 3]
        share = (time_s - times_s[after - 1]) / (times_s[after] - times_s[after - 1])
        turned = Rotation.from_matrix(one[:3, :3].T @ other[:3, :3]).as_rotvec()
        if np.linalg.norm(turned) > _ABOUT_RAD:  # labelled the other way round: there is nothing in between
            turned, one = np.zeros(3), (one if share < 0.5 else other)
        pose = one.copy()
        pose[:3, :3] = one[:3, :3] @ Rotation.from_rotvec(share * turned).as_matrix()
        pose[:3, 3] = (1 - share) * first + share * last
        return pose

    def row_at(self, time_s: float) -> int:
        """The label that is nearest in time."""
        return int(np.abs(self.times_s - time_s).argmin())

    def corners(self, row: int) -> Float[np.ndarray, "8 3"]:
        """Its corners at a label, see ``box_corners``."""
        return box_corners(self.world_from_box[row], self.size_lwh_m[row])


def box_corners(
    world_from_box: Float[np.ndarray, "4 4"], size_lwh_m: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, "8 3"]:
    """Corners in the world: ahead left, ahead right, behind right, behind left; above, then below."""
    x, y, z = size_lwh_m / 2
    flat = np.array([[x, y], [x, -y], [-x, -y], [-x, y]])
    box = np.vstack([np.column_stack([flat, np.full(4, height)]) for height in (z, -z)])
    return box @ world_from_box[:3, :3].T + world_from_box[:3, 3]


def word_of(category: str, words: Mapping[str, Word]) -> Word | None:
    """What a table says of a category, by the beginning of its name; None where it says nothing.

    ``vehicle.bus`` begins ``vehicle.bus.rigid``; ``vehicle.car`` does not begin ``vehicle.carriage``.
    """
    return next((word for begins, word in words.items() if f"{category}.".startswith(f"{begins}.")), None)


@dataclass(frozen=True)
class LidarSweep:
    """One turn of a lidar, brought to one time.

    Attributes:
        file: Its points.
        time_s: On the clock of the log.
        world_from_points: From the frame of the file's points to the world.
    """

    file: Path
    time_s: float
    world_from_points: Float[np.ndarray, "4 4"]


@dataclass(frozen=True)
class Polygon:
    """An area of a map in the plane of the world, in metres; rings are not repeated at their end."""

    outline: Float[np.ndarray, "n 2"]
    holes: tuple[Float[np.ndarray, "_ 2"], ...] = ()


LANE_CENTRE = "lane_centre"
"""Layer of lines: the middle of each lane in the direction of travel. nuScenes' map expansion lacks it."""


@dataclass(frozen=True)
class LogMap:
    """A map by layers, which have the names of nuScenes' map expansion, such as ``drivable_area``."""

    areas: Mapping[str, tuple[Polygon, ...]] = field(default_factory=dict)
    lines: Mapping[str, tuple[Float[np.ndarray, "_ 2"], ...]] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return any(self.areas.values()) or any(self.lines.values())


@dataclass(frozen=True)
class Log:
    """One drive of a data set.

    Attributes:
        name: Of the drive, such as ``scene-0061``.
        about: What happens, in words of the data set.
        location: Which map it is on.
        root: Folder of the data set.
        cameras: The front camera first; empty where pictures are not read.
        times_s: Times that are labelled, on the clock of the log: seconds since ``start_us``.
        start_us: The first of them in microseconds since 1970.
        world_from_ego: Where the car was at those times.
        boxes: What was labelled.
        sweeps: What the lidar measured; empty where there is none.
        map: Of the surroundings; empty where there is none.
        notes: What was taken in place of something else, in sentences.
        problems: What is missing or broken, in sentences.
    """

    name: str
    about: str
    location: str
    root: Path
    cameras: tuple[LogCamera, ...]
    times_s: Float[np.ndarray, " t"]
    start_us: int
    world_from_ego: Float[np.ndarray, "t 4 4"]
    boxes: tuple[BoxTrack, ...] = ()
    sweeps: tuple[LidarSweep, ...] = ()
    map: LogMap = field(default_factory=LogMap)
    notes: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()

    def camera(self, name: str) -> LogCamera:
        """The camera of that name, however it is written: ``CAM_FRONT`` is ``front``, too."""
        wanted = _plain(name)
        found = next((each for each in self.cameras if _plain(each.name) == wanted), None)
        if found is None:
            known = ", ".join(_plain(each.name) for each in self.cameras)
            raise InputError(f"{self.name} has no camera {name}; it has {known}")
        return found


@dataclass(frozen=True)
class OfLog:
    """Where what was made of a log lies in it.

    Attributes:
        name: Of the log.
        log_from_world: From the world of a clip or a scene to that of the log (4 rows of 4).
        start_s: Their time 0 on the clock of the log.
        level_z_m: Height, in the world of the log, of a level road that stands for its own: the car and all
            boxes were made to stand upright on it. None where they are as high as in the log.
    """

    name: str
    log_from_world: tuple[tuple[float, ...], ...]
    start_s: float
    level_z_m: float | None = None

    @staticmethod
    def of(
        log: Log,
        log_from_world: Float[np.ndarray, "4 4"],
        start_s: float,
        level_z_m: float | None = None,
    ) -> "OfLog":
        """The place in a log, from numbers of NumPy."""
        rows = tuple(tuple(map(float, row)) for row in log_from_world)
        return OfLog(log.name, rows, float(start_s), level_z_m)


def _plain(name: str) -> str:
    return name.lower().removeprefix("cam_").removesuffix("_camera")
