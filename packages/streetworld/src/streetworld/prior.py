"""The prior that ships in the box: a drive through a procedural street, drawn at random or given."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from msgspec import structs

from dreamdrive.data.cameras.poses import to_first
from dreamdrive.data.frames.select import held_out_mask
from dreamdrive.data.layout_file import read_layout
from dreamdrive.data.planned import Planned
from dreamdrive.datasets.log_layout import AREAS, LINES, kind_of
from dreamdrive.datasets.logs import CAR_FROM_EGO, samplers_of
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.protocol import Input, Prior
from dreamdrive.prior.street import (
    StreetSource,
    check_no_scene,
    map_from_cameras,
    place_in_log,
    read_street,
    wanted_frames,
)
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.control import Control, StreetInput, check_video_size, fields_of
from dreamdrive.scene.street.layout import Layout
from dreamdrive.scene.street.log import Log
from dreamdrive.scene.street.truth import DriveTruth
from streetworld import StreetOptions, World, draw_street, drive, pictures

FRAMES = 24
"""Length of the drive unless ``control.frames`` says where to stop."""
RATE_HZ = 10.0
"""Rate unless told."""
SIZE = (320, 192)
"""Width and height of a layout's frames unless told; those of a scene are as those of a recording."""
_EDITION = 2
"""What draws scenes of data sets: the first edition knows no buses and looks 64 degrees wide."""


def street_world(opened: Input, progress: Progress = silent) -> Clip:
    """A clip of simulated frames, as calibrated cameras give it; Z_ref is ``features["appearance"]``.

    The street is that of the layout ``control.path`` or of a scene of a data set, which its own cameras see;
    or one that ``control.seed`` decides.
    """
    control = opened.control
    fps = RATE_HZ if control.fps is None else control.fps
    if control.path is None:
        check_no_scene(control)
        street = None
    else:
        street = read_street(opened, control.path)
    wanted = np.array(wanted_frames(control, FRAMES, fps, street))
    held_out_mask(len(wanted), control.hold_out)  # complains before anything is drawn
    if street is not None and street.log is not None:
        return _clip_of_scene(control, street, street.log, wanted, fps, progress)
    size = control.size or SIZE
    check_video_size(size)
    count = int(wanted[-1]) + 1
    if street is None:
        layout = draw_street(control.seed, StreetOptions(seconds=count / fps))
        source = f"a procedural street, seed {control.seed}"
    else:
        layout, source = street.layout, street.name
    made = drive(layout, count, fps, size, progress=progress)
    said = f"The references are simulated: frames of {source}, handed over with exact intrinsics only."
    rig = (made.cameras[wanted[0]].at(np.eye(4)),)
    return _clip(control, made.frames[wanted], wanted, fps, rig, [said])


def _clip(
    control: Control,
    frames: np.ndarray,
    wanted: Int[np.ndarray, " t"],
    fps: float,
    rig: tuple[Camera, ...],
    notes: list[str],
) -> Clip:
    """Frames of time steps, by time, then camera, with what is known of them."""
    valid = np.ones(frames.shape[:3], dtype=bool)
    return Clip(
        frames=frames,
        times_s=np.repeat((wanted - wanted[0]) / fps, len(rig)),
        camera=np.tile(np.arange(len(rig)), len(wanted)),
        rig=rig,
        valid=valid,
        held_out=np.repeat(held_out_mask(len(wanted), control.hold_out), len(rig)),
        source_index=np.repeat(wanted, len(rig)),
        features={"appearance": appearance(frames, valid)},
        known=Known(intrinsics=True),
        provenance={"prior": "street-world", "seed": control.seed, "notes": notes},
    )


def _clip_of_scene(
    control: Control,
    street: StreetSource,
    log: Log,
    wanted: Int[np.ndarray, " t"],
    fps: float,
    progress: Progress,
) -> Clip:
    """What the cameras of a scene see of its layout, in frames of the size that its own pictures get."""
    pinholes = [sampler.camera for sampler in samplers_of(street.cameras, control.size)]
    names = [camera.name for camera in street.cameras]
    times_s = np.repeat(wanted, len(names)) / fps
    poses = map_from_cameras(street, wanted / fps).reshape(-1, 4, 4)
    placed = [pinholes[k % len(names)].at(pose) for k, pose in enumerate(poses)]
    frames: list[np.ndarray] = []
    for view in pictures(World(_drawn(street.layout)), placed, times_s, placed, times_s):
        frames.append(view.frame)
        progress(len(frames), len(placed))
    rig = (pinholes[0].at(np.eye(4)),)
    if len(names) > 1:
        mounted = [CAR_FROM_EGO @ camera.ego_from_camera for camera in street.cameras]
        rig = tuple(pinhole.at(pose) for pinhole, pose in zip(pinholes, mounted, strict=True))
    clip = _clip(control, np.stack(frames), wanted, fps, rig, _notes(street, log))
    return replace(
        clip,
        known=Known(to_first(poses), intrinsics=True),
        log=place_in_log(street, float(wanted[0] / fps)),
        provenance={**clip.provenance, "cameras": names},
    )


def _drawn(layout: Layout) -> Layout:
    """The layout of a scene as it is drawn: nobody tells what its road users look like, and all differ."""
    boxes = [structs.replace(box, look=number) for number, box in enumerate(layout.boxes)]
    return structs.replace(layout, boxes=boxes, edition=_EDITION)


def _notes(street: StreetSource, log: Log) -> list[str]:
    """What the frames are, and what a scene does not tell of its street."""
    notes = [
        f"The references are simulated: frames of {street.name}, handed over with exact intrinsics and "
        "poses. Map and boxes are drawn, and what a scene does not tell is not there: houses, trees, signs, "
        "hills. The car stands level on the road, and the looks of road users are made up.",
        *log.notes,
    ]
    layers = {**AREAS, **LINES}
    there = {name for name in layers if log.map.areas.get(name) or log.map.lines.get(name)}
    if missing := [name for name in layers if name not in there]:
        rest = "all ground is grass" if not there else "they are not drawn"
        notes.append(f"The map of {log.name} has no {', '.join(missing)}: {rest}.")
    left_out = sorted({track.category for track in log.boxes if kind_of(track.category) is None})
    if left_out:
        notes.append(f"Things of these kinds are not drawn: {', '.join(left_out)}.")
    return notes


def drawn_again(
    layout: Path, index: Int[np.ndarray, " f"], times_s: Float[np.ndarray, " f"], size: tuple[int, int]
) -> DriveTruth:
    """A layout as the source was drawn whose frames ``index`` are; of a single frame any rate will do."""
    span_s = float(np.ptp(times_s))
    rate_hz = float(np.ptp(index)) / span_s if span_s > 0 else 10.0
    return drive(read_layout(layout), int(index.max()) + 1, rate_hz, size)


def planned_of(opened: Input) -> Planned:
    """What a run will work on."""
    control = opened.control
    street = None if control.path is None else read_street(opened, control.path)
    rows = wanted_frames(control, FRAMES, RATE_HZ if control.fps is None else control.fps, street)
    cameras = () if street is None else street.cameras
    size = samplers_of(cameras, control.size)[0].sizing.target if cameras else control.size or SIZE
    return Planned(len(rows), max(1, len(cameras)), size, None, rows.start, rows.step, True)


STREET_WORLD = Prior(
    name="street-world",
    make=street_world,
    takes=fields_of(StreetInput),
    of_street=True,
    gives="exact intrinsics; of a scene of a data set poses and mountings as well",
    about="a drive through a layout, a scene of a data set or a street drawn at random; frames are simulated",
    licence="Apache-2.0, as all of dreamdrive",
    memory="0.5 GB for 24 frames at 480x270",
    plan=planned_of,
    truth=drawn_again,
)
