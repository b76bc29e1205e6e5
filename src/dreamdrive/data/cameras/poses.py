"""Poses of a clip from a file, and trajectories on disk."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.data.formats.pandaset import pandaset_camera
from dreamdrive.data.formats.pose_lists import (
    FORMATS,
    json_of,
    poses_of_json,
    poses_of_text,
    text_of,
)
from dreamdrive.data.formats.rigid import PoseRows
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import parse_json, read_json
from dreamdrive.files.output import new_file
from dreamdrive.files.paths import read_text
from dreamdrive.scene.trajectory import Trajectory

_CLOCKS_DIFFER = 0.05
"""Part by which the rates of two clocks may differ that tell the same times."""
_CLOCK_NOTE = "The times of the pose file count from its first row, taken as frame 0 of the input."


def read_pose_file(path: Path, option: str, camera: str | None = None) -> PoseRows:
    """Read a pose file of any of the formats; the content decides which it is.

    Messages call it ``option``; ``camera`` is the name to look for in PandaSet's ``cameras.json``.
    """
    where = f"{option} {path}"
    text = read_text(path, where)
    if not text.lstrip().startswith(("{", "[")):
        return poses_of_text(text, where)
    values = read_json(path, option)
    if "world_from_camera" in values:
        return poses_of_json(values, where)
    if "cameras" in values:
        return pandaset_camera(values, where, camera).rows
    raise InputError(f"{where}: expected {FORMATS}")


def read_trajectory(path: Path) -> Trajectory:
    """Read a path of the camera in the world frame: JSON or TUM, with times."""
    rows = read_pose_file(path, "trajectory")
    if rows.times_s is None:
        raise InputError(f"trajectory {path} has poses but no times; expected Trajectory JSON or TUM")
    return Trajectory(rows.world_from_camera, rows.times_s)


def read_trajectories(path: Path) -> list[Trajectory]:
    """Read several paths of the camera: a JSON list of objects, each as ``read_trajectory`` takes it."""
    expected = "a JSON list of Trajectory objects, each with world_from_camera and times_s"
    values = parse_json(read_text(path, f"trajectories {path}"), f"trajectories {path}")
    listed = cast("list[Any]", values) if isinstance(values, list) else [values]
    if not isinstance(values, list) or not all(isinstance(each, dict) for each in listed):
        raise InputError(f"trajectories {path} holds something else; expected {expected}")
    found: list[Trajectory] = []
    for number, each in enumerate(listed):
        rows = poses_of_json(each, f"trajectories {path}, number {number + 1}")
        if rows.times_s is None:
            raise InputError(f"trajectories {path}, number {number + 1}: no times_s; expected {expected}")
        found.append(Trajectory(rows.world_from_camera, rows.times_s))
    if not found:
        raise InputError(f"trajectories {path} is an empty list; expected {expected}")
    return found


def write_trajectory(trajectory: Trajectory, path: Path) -> None:
    """Write TUM, or JSON where the name ends in ``.json``; an older file is replaced in one step."""
    text = json_of(trajectory) if path.suffix.lower() == ".json" else text_of(trajectory)
    with new_file(path) as partial:
        partial.write_text(text, "utf-8")


def of_frames(
    rows: PoseRows,
    index: Int[np.ndarray, " f"],
    times_s: Float[np.ndarray, " f"],
    count: Callable[[], int],
) -> tuple[Float[np.ndarray, "f 4 4"], tuple[str, ...]]:
    """Those of a file's poses that are of the selected frames, in the frame of the first, and notes.

    A file has one pose per frame of the source, or one per selected frame, and its times, if it has any, run
    as those of the frames do; else poses with times are matched to the nearest frame within half a frame,
    both since frame 0 of the source. ``count`` gives the number of frames of the source; it is called only
    where it decides.
    """
    notes: tuple[str, ...] = ()
    chosen = _by_count(rows, index, count)
    if rows.times_s is None and chosen is None:
        raise InputError(
            f"{rows.where} has {len(rows)} poses, but the input has {count()} frames, {len(index)} of "
            "them selected; expected one pose per frame of the input or per selected frame"
        )
    if rows.times_s is not None and (chosen is None or not _run_alike(rows.times_s[chosen], times_s)):
        chosen, notes = _by_time(rows.where, rows.times_s, index, times_s, counts=chosen is not None)
    return to_first(rows.world_from_camera[chosen]), notes


def _by_count(
    rows: PoseRows, index: Int[np.ndarray, " f"], count: Callable[[], int]
) -> Int[np.ndarray, " f"] | None:
    """The rows of the frames where there is one for each of them, or one for each of the source."""
    if len(rows) == len(index):
        return np.arange(len(index))
    return np.asarray(index) if len(rows) == count() else None


def _run_alike(rows_s: Float[np.ndarray, " f"], times_s: Float[np.ndarray, " f"]) -> bool:
    """Whether two clocks differ by where they start and, a little, by how fast they run."""
    if len(times_s) < 2:
        return True
    ours_s, theirs_s = times_s - times_s[0], rows_s - rows_s[0]
    rate = theirs_s[-1] / ours_s[-1]
    apart_s = np.abs(theirs_s - rate * ours_s).max()
    return bool(abs(rate - 1) < _CLOCKS_DIFFER and apart_s <= np.median(np.diff(times_s)))


def to_first(poses: Float[np.ndarray, "f 4 4"]) -> Float[np.ndarray, "f 4 4"]:
    """Rigid poses relative to the first of them, which becomes exactly the identity."""
    first = poses[0]
    inverse = np.eye(4)
    inverse[:3, :3] = first[:3, :3].T
    inverse[:3, 3] = -first[:3, :3].T @ first[:3, 3]
    moved = inverse @ poses
    moved[0] = np.eye(4)
    return moved


def _by_time(
    where: str,
    rows_s: Float[np.ndarray, " n"],
    index: Int[np.ndarray, " f"],
    times_s: Float[np.ndarray, " f"],
    *,
    counts: bool,
) -> tuple[Int[np.ndarray, " f"], tuple[str, ...]]:
    """The nearest row of each frame, on the source's clock or, if that cannot be, on the file's own.

    ``counts`` tells that the file has as many rows as there are frames, whose times run otherwise.
    """
    period_s = float(np.median(np.diff(times_s) / np.diff(index)))
    worst = np.inf
    for clock_s, notes in ((rows_s, ()), (rows_s - rows_s[0], (_CLOCK_NOTE,))):
        chosen = np.abs(times_s[:, None] - clock_s[None, :]).argmin(axis=1)
        gap = np.abs(times_s - clock_s[chosen])
        if gap.max() <= period_s / 2 and (np.diff(chosen) > 0).all():
            return chosen, notes
        worst = min(worst, float(gap.max()))
    if counts:
        steps = index[-1] - index[0] if len(rows_s) == len(index) else len(rows_s) - 1
        span_s = rows_s[-1] - rows_s[0]
        raise InputError(
            f"{where} has a pose for each frame, but its times span {span_s:.3g} s and those of the frames "
            f"{times_s[-1] - times_s[0]:.3g} s; if it is of these frames, give --fps "
            f"{steps / max(span_s, 1e-9):.3g}, or leave the times out of the file"
        )
    raise InputError(
        f"{where}: its {len(rows_s)} poses (times {rows_s[0]:g} to {rows_s[-1]:g} s) do not meet the "
        f"{len(index)} selected frames ({times_s[0]:g} to {times_s[-1]:g} s): a frame lies {worst:.3g} s "
        f"from the nearest pose, at most half a frame ({period_s / 2:.3g} s) is allowed; is --fps right?"
    )
