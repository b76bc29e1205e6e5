"""Input of a map-conditioned prior: a layout, or a scene of a data set with its cameras.

Of a scene its boxes, map, path and calibration count; its pictures are never opened.
"""

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from dreamdrive.data.frames.select import Selection
from dreamdrive.data.layout_file import read_layout
from dreamdrive.datasets.log_layout import layout_of_log
from dreamdrive.datasets.logs import choose_cameras
from dreamdrive.errors import InputError
from dreamdrive.prior.protocol import Input
from dreamdrive.scene.control import Control, DataSetDrive, flag_of
from dreamdrive.scene.level import upright
from dreamdrive.scene.street.layout import Layout, track_function
from dreamdrive.scene.street.log import Log, LogCamera, OfLog
from dreamdrive.scene.trajectory import Trajectory

_EARLIER_S = 1e-6
"""Times of a frame and of the last label that are equal differ by rounding."""


@dataclass(frozen=True)
class StreetSource:
    """What is to be seen, and of a scene of a data set from where.

    Attributes:
        layout: The street from above; of a scene, ``data.log_layout.layout_of_log``.
        name: What it is, in words.
        log: The scene; None where the street is a layout file.
        cameras: Those that are asked for, the leading one first; none where the street is a layout file.
    """

    layout: Layout
    name: str
    log: Log | None = None
    cameras: tuple[LogCamera, ...] = ()

    def count(self, rate_hz: float) -> int | None:
        """How many frames there are at a rate, from the first label to the last; None where it never ends."""
        return None if self.log is None else int(float(self.log.times_s[-1]) * rate_hz + _EARLIER_S) + 1


def read_street(opened: Input, path: Path, without: str | None = None) -> StreetSource:
    """The street of a layout file, or of a scene of a data set.

    Args:
        opened: The input; its control's ``cameras`` choose of a data set.
        path: The layout, or a folder of a data set.
        without: The cameras where none are asked for, as ``--cameras``; the one that looks ahead unless told.
    """
    control, log = opened.control, opened.log
    if log is not None:
        cameras = choose_cameras(log, without if control.cameras is None else control.cameras)
        return StreetSource(
            layout_of_log(log), f"the scene {log.name} of {log.root.name}", log, tuple(cameras)
        )
    check_no_scene(control)
    if path.is_dir():
        raise InputError(
            f"{path} is a folder that holds no scenes with maps and boxes; expected a layout as JSON, see "
            "docs/layout.md, or a folder of a data set: dreamdrive data list tells which there are"
        )
    return StreetSource(read_layout(path), f"the layout {path.name}")


def check_no_scene(control: Control) -> None:
    """Refuse fields that choose of a data set where there is none."""
    chosen = [each.name for each in fields(DataSetDrive)]
    if given := [flag_of(name) for name in chosen if getattr(control, name) is not None]:
        got = "there is no input" if control.path is None else f"{control.path} is none with scenes"
        raise InputError(
            f"{' and '.join(given)} choose of a data set, and {got}; leave them out, or give a folder of one"
        )


def wanted_frames(control: Control, usual: int, rate_hz: float, street: StreetSource | None = None) -> range:
    """The frames to make: ``usual`` many unless ``control.frames`` says where to stop.

    A scene of a data set ends with its last label, and negative numbers count from there.
    """
    if not rate_hz > 0:
        raise InputError(f"--fps {rate_hz:g}: expected more than 0")
    selection = Selection.parse(control.frames)
    count = None if street is None else street.count(rate_hz)
    if selection.stop is None and (count is None or selection.start >= 0):
        stop = max(usual, selection.start + usual)
        selection = replace(selection, stop=stop if count is None else min(stop, count))
    if count is None:
        count = usual if selection.needs_count else None
        return selection.resolve(count, "the drive")
    assert street is not None
    if selection.start >= count:
        raise InputError(
            f"--frames {control.frames} selects no frame: {street.name} has {count} frames at {rate_hz:g} Hz"
        )
    return selection.resolve(count, f"{street.name}, at {rate_hz:g} Hz,")


def map_from_cameras(street: StreetSource, times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t n 4 4"]:
    """Poses of a scene's cameras in its layout: the car stands level on the road, as the layout has it.

    The first camera of the scene follows the layout's path; how it is tilted on the car, and where the others
    are, is as calibrated.
    """
    assert street.log is not None
    ego = street.layout.ego
    below = np.eye(4)
    below[:3, 3] = -street.log.cameras[0].ego_from_camera[:3, 3]
    below[2, 3] += ego.camera_height_m
    mounted = np.stack([below @ camera.ego_from_camera for camera in street.cameras])
    places = np.stack([upright(place) for place in track_function(ego.track)(times_s)])
    return places[:, None] @ mounted


def place_in_log(street: StreetSource, time_s: float) -> OfLog:
    """Where a clip lies in its scene's log, whose first frame is of ``time_s`` and of the first camera.

    In the plane it is exact: a layout is the log's plane, moved. It has no heights, so that its level road
    lies as high as the log's car is at ``time_s``, all along the drive. The log's own car and boxes leave
    that road by as much as the street rises or falls, 3 m after 100 m at 3 %, and by the tilt of the car.
    ``OfLog.level_z_m`` says so: whoever stands them on that road upright has them where the frames show
    them, and what remains is that of paths between two labels, splines here and straight lines there.
    """
    log = street.log
    assert log is not None
    car = Trajectory(log.world_from_ego, log.times_s).at(np.array([time_s]))[0]
    log_from_map = np.eye(4)
    log_from_map[:2, 3] = log.world_from_ego[0, :2, 3]  # the layout's origin
    log_from_map[2, 3] = car[2, 3]
    first = log_from_map @ map_from_cameras(street, np.array([time_s]))[0, 0]
    return OfLog.of(log, first, time_s, float(car[2, 3]))
