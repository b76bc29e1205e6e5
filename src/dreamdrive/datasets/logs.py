"""Clips of logs: pictures of one or several cameras of a drive, with the poses that are known."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from dreamdrive.data.cameras.intrinsics import Calibration
from dreamdrive.data.cameras.poses import to_first
from dreamdrive.data.dataset import DataSet, Logs
from dreamdrive.data.frames.cuts import find_cuts
from dreamdrive.data.frames.remarks import of_cuts
from dreamdrive.data.frames.select import MAX_FRAMES, Selection, held_out_mask, of_thinning, thinning
from dreamdrive.data.frames.size import MAX_CROP, cover, cut_share
from dreamdrive.data.pictures.images import read_image
from dreamdrive.data.pictures.sampler import Sampler, check_pictures, most_frames, too_many
from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip, Known, Recorded
from dreamdrive.scene.street.log import Log, LogCamera, OfLog

CAR_FROM_EGO = np.array([[0.0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]])
"""From x ahead, y left, z up to the axes of a camera that looks ahead."""
ALL = "all"
REACH = 0.6
"""Steps of the first camera within which a picture of another one is of the same time: cameras of a car go
off up to half a step apart."""

MOST_CUT = 0.3
"""Share of the pictures of a camera that may be cut away to the shape of the first, 0.25 from 4:3 to 16:9."""


@dataclass(frozen=True)
class Shots:
    """Pictures of a log that are wanted: of one camera, and the step of the first camera that each is of."""

    camera: LogCamera
    rows: Int[np.ndarray, " n"]
    steps: Int[np.ndarray, " n"]


def choose_cameras(log: Log, cameras: str | None = None) -> Sequence[LogCamera]:
    """Cameras by their names with commas, or ``all``; without it the first, which looks ahead."""
    if cameras is None:
        return log.cameras[:1]
    if cameras == ALL:
        return log.cameras
    names = [name.strip() for name in cameras.split(",")]
    chosen = [log.camera(name) for name in names]
    if len({each.name for each in chosen}) < len(chosen):
        raise InputError(f"--cameras {cameras}: a camera is named twice; expected each once")
    return chosen


def choose_shots(log: Log, cameras: str | None = None, frames: str | None = None) -> list[Shots]:
    """The wanted pictures by camera.

    Args:
        log: The drive.
        cameras: Names with commas, or ``all``; without it the first camera, which looks ahead.
        frames: ``START:STOP:STEP`` over the pictures of the first of them. The others give the picture that
            is nearest in time, where one is at most ``REACH`` steps away. Without it all, or where these are
            too many for a clip every second one, every fourth, and so on.
    """
    lead, *others = choose_cameras(log, cameras)
    rows = np.array(Selection.parse(frames).resolve(len(lead), f"{lead.name} of {log.name}"))
    interval_s = float(np.median(np.diff(lead.times_s))) if len(lead) > 1 else 0.0
    if Selection.parse(frames).is_whole and interval_s > 0:
        rows = rows[:: thinning(len(rows) * (1 + len(others)), 1 / interval_s, MAX_FRAMES)]
    if len(rows) < 2:
        raise InputError(f"{lead.name} of {log.name}: a single picture is chosen; expected at least two")
    shots = [Shots(lead, rows, np.arange(len(rows)))]
    times_s = lead.times_s[rows]
    reach_s = REACH * float(np.median(np.diff(times_s)))
    for camera in others:
        near = np.abs(camera.times_s[None] - times_s[:, None])
        picked = near.argmin(axis=1)
        own = np.abs(times_s[None] - camera.times_s[picked][:, None]).argmin(axis=1) == np.arange(len(rows))
        taken = np.flatnonzero((near.min(axis=1) <= reach_s) & own)
        if not len(taken):
            raise InputError(
                f"{camera.name} of {log.name} has no picture within {reach_s:.2f} s of those of {lead.name}; "
                "choose other --frames, or leave the camera out"
            )
        shots.append(Shots(camera, picked[taken], taken))
    return shots


def samplers_of(cameras: Sequence[LogCamera], size: tuple[int, int] | None) -> list[Sampler]:
    """How the pictures of each camera become frames of one size, which the first camera tells.

    Raises:
        InputError: Too much of a camera's pictures would be cut away for that.
    """
    lead, *others = cameras
    made = [Sampler.create(_size(lead), size, Calibration(lead.pinhole, None, True, ()))]
    target = made[0].sizing.target
    for camera in others:
        cut, notes = cut_share(_size(camera), target), tuple[str, ...]()
        if cut > MOST_CUT:
            (w, h), (w2, h2) = _size(lead), _size(camera)
            raise InputError(
                f"{lead.name} has pictures of {w}x{h}, {camera.name} of {w2}x{h2}: of these "
                f"{100 * cut:.0f} % would be cut away to one shape; choose cameras of like shapes with "
                "--cameras"
            )
        if cut > MAX_CROP:
            notes = (
                f"{camera.name}: {100 * cut:.0f} % of its pictures is cut away to the shape of {lead.name}.",
            )
        made.append(Sampler.of(cover(_size(camera), target), Calibration(camera.pinhole, None, True, notes)))
    return made


def _size(camera: LogCamera) -> tuple[int, int]:
    return camera.pinhole.width_px, camera.pinhole.height_px


def clip_of_log(
    log: Log,
    *,
    cameras: str | None = None,
    frames: str | None = None,
    size: tuple[int, int] | None = None,
    hold_out: int | None = None,
) -> Clip:
    """The clip of a drive: poses and calibration are known; boxes, lidar and map are no part of it.

    The world is the first camera at its first picture. Pictures that belong together count as taken at one
    time, that of the first camera; each has its own pose.

    Args:
        log: The drive.
        cameras: See ``choose_shots``.
        frames: See ``choose_shots``.
        size: Exact width and height; without it that of the first camera's pictures, 480 wide.
        hold_out: Withhold of each camera the pictures i with i mod N = N // 2.

    Raises:
        InputError: The choice cannot be met, or pictures cannot be read.
    """
    shots = choose_shots(log, cameras, frames)
    samplers = samplers_of([one.camera for one in shots], size)
    target = samplers[0].sizing.target
    if sum(len(each.rows) for each in shots) > most_frames(target):
        raise too_many(most_frames(target), target, log.root)
    parts = [_read(log, one, sampler) for one, sampler in zip(shots, samplers, strict=True)]
    held = [_held_out(log, one, hold_out) for one in shots]
    camera = np.repeat(np.arange(len(shots)), [len(each.rows) for each in shots])
    step = np.concatenate([each.steps for each in shots])
    order = np.lexsort((camera, step))
    frames_rgb, valid = (np.concatenate([part[k] for part in parts])[order] for k in range(2))
    check_pictures(frames_rgb, valid, log.root)
    poses = np.concatenate([each.camera.world_from_camera[each.rows] for each in shots])[order]
    lead = shots[0]
    times_s = lead.camera.times_s[lead.rows]
    cuts, said = _cuts(frames_rgb, valid, camera[order], lead.rows)
    said += of_thinning(int(lead.rows[1] - lead.rows[0]) if Selection.parse(frames).is_whole else 1)
    sizing = samplers[0].sizing
    several = len(shots) > 1
    return Clip(
        frames=frames_rgb,
        times_s=(times_s - times_s[0])[step[order]],
        camera=camera[order],
        rig=tuple(
            sampler.camera.at(CAR_FROM_EGO @ one.camera.ego_from_camera if several else np.eye(4))
            for one, sampler in zip(shots, samplers, strict=True)
        ),
        valid=valid,
        held_out=np.concatenate(held)[order],
        source_index=np.concatenate([each.rows for each in shots])[order],
        known=Known(world_from_camera=to_first(poses), intrinsics=True),
        cuts=cuts,
        recorded=Recorded(str(log.root), False, sizing.source, sizing.scaled, sizing.offset),
        log=OfLog.of(log, lead.camera.world_from_camera[lead.rows[0]], times_s[0]),
        provenance={
            "notes": [*_missing(shots), *said, *(note for each in samplers for note in each.notes)],
            "log": log.name,
            "cameras": [each.camera.name for each in shots],
        },
    )


def files_of(shots: Sequence[Shots]) -> tuple[tuple[Path, ...], list[Any]]:
    """The files that a clip is made of, and all else that decides it, as JSON values."""
    files = [each.camera.files[row] for each in shots for row in each.rows]
    told: list[Any] = []
    for each in shots:
        camera, pinhole = each.camera, each.camera.pinhole
        seen = [pinhole.matrix.tolist(), pinhole.width_px, pinhole.height_px, camera.ego_from_camera.tolist()]
        poses = camera.world_from_camera[each.rows].tolist()
        told.append([camera.name, seen, poses, camera.times_s[each.rows].tolist(), each.steps.tolist()])
    return tuple(files), told


def told_of_street(log: Log) -> list[object]:
    """All of a scene that a map-conditioned prior may use, for a digest: no pictures and no points."""
    lead = log.cameras[0]  # whose path is the car's
    return [
        [log.name, log.about, log.location, log.times_s, log.world_from_ego, log.notes],
        [[each.name, each.pinhole, each.ego_from_camera] for each in log.cameras],
        [lead.times_s, lead.world_from_camera],
        log.boxes,
        [[each.time_s, each.world_from_points] for each in log.sweeps],
        [dict(log.map.areas), dict(log.map.lines)],
    ]


def _read(log: Log, shots: Shots, sampler: Sampler) -> tuple[Any, Any]:
    """Frames of one camera and where they hold a picture."""
    frames: list[Any] = []
    valid: list[Any] = []
    for index, row in enumerate(shots.rows):
        raw = read_image(shots.camera.files[row], index)
        if raw.size != sampler.sizing.source:
            raise InputError(
                f"{shots.camera.files[row]} is {raw.size[0]}x{raw.size[1]}, but the tables of {log.name} say "
                f"{sampler.sizing.source[0]}x{sampler.sizing.source[1]}"
            )
        made = sampler(raw)
        frames.append(made.rgb)
        valid.append(made.opaque)
    return np.stack(frames), np.stack(valid)


def _held_out(log: Log, shots: Shots, every: int | None) -> Any:
    try:
        return held_out_mask(len(shots.rows), every)
    except InputError as error:
        raise InputError(f"{shots.camera.name} of {log.name}: {error}") from None


def _cuts(
    frames: Any, valid: Any, camera: Int[np.ndarray, " f"], lead: Int[np.ndarray, " n"]
) -> tuple[tuple[int, ...], list[str]]:
    """Changes to another scene, camera by camera.

    What is said of them is that of the first camera, whose pictures are ``lead`` of those in the source.
    """
    cuts: list[int] = []
    said: list[str] = []
    for k in range(int(camera.max()) + 1):
        rows = np.flatnonzero(camera == k)
        found = find_cuts(frames[rows], valid[rows])
        cuts += [int(rows[cut.first]) for cut in found.cuts]
        said += of_cuts(found, lead) if k == 0 else []
    return tuple(sorted(cuts)), said


def _missing(shots: Sequence[Shots]) -> list[str]:
    """What to say of cameras that have pictures at some of the times only."""
    steps = len(shots[0].rows)
    fewer = [f"{each.camera.name} at {len(each.rows)}" for each in shots if len(each.rows) < steps]
    return [f"Of {steps} times, pictures are there of {', '.join(fewer)} only."] if fewer else []


def data_set_of_logs(name: str, about: str, recognises: Callable[[Path], bool], logs: Logs) -> DataSet:
    """A data set of drives, by its name for ``--dataset``.

    Args:
        name: For the command line.
        about: What lies at its paths, for people.
        recognises: Whether a path is one of it, by the names of files.
        logs: Its drives.
    """

    def read(
        path: Path,
        *,
        scene: str | None = None,
        cameras: str | None = None,
        frames: str | None = None,
        size: tuple[int, int] | None = None,
        hold_out: int | None = None,
    ) -> Clip:
        log = logs.open(path, scene)
        return clip_of_log(log, cameras=cameras, frames=frames, size=size, hold_out=hold_out)

    opened = replace(logs, clip=clip_of_log)
    return DataSet(name=name, about=about, recognises=recognises, read=read, logs=opened)
