"""The frames that a run of a recording will work on, told before it is read."""

import numpy as np

from dreamdrive.data.clip_reader import FOLDER_RATE_HZ
from dreamdrive.data.frames.select import MAX_FRAMES, Selection, thinning
from dreamdrive.data.frames.size import choose_size
from dreamdrive.data.pictures.video import Video
from dreamdrive.data.planned import Planned
from dreamdrive.data.source import open_source
from dreamdrive.data.table import DATASETS
from dreamdrive.datasets.logs import choose_shots
from dreamdrive.scene.control import Control
from dreamdrive.scene.street.log import Log


def planned_of(control: Control, log: Log | None) -> Planned | None:
    """Of a recording, or of the drive of a data set; None where that is unknown before it is read."""
    if control.path is None or DATASETS.package(control.dataset):
        return None
    return _of_recording(control) if log is None else _of_log(control, log)


def _of_log(control: Control, log: Log) -> Planned:
    shots = choose_shots(log, control.cameras, control.frames)
    lead = shots[0].camera
    rows = shots[0].rows
    size = choose_size((lead.pinhole.width_px, lead.pinhole.height_px), control.size).target
    rate_hz = 1 / float(np.median(np.diff(lead.times_s)))
    step = int(rows[1] - rows[0])
    return Planned(len(rows), len(shots), size, rate_hz, int(rows[0]), step, control.frames is not None)


def _of_recording(control: Control) -> Planned | None:
    from dreamdrive.data.rig import is_rig, read_rig

    assert control.path is not None
    selection = Selection.parse(control.frames)
    rig = read_rig(control.path) if is_rig(control.path) else ()
    source = open_source(rig[0].frames if rig else control.path)
    claimed = source.claimed_count() if isinstance(source, Video) else source.count()
    if claimed is None:
        return None
    wanted = range(claimed)[selection.start : selection.stop : selection.step]
    rate_hz = control.fps or (source.rate_hz if isinstance(source, Video) else None)
    if selection.is_whole:
        wanted = wanted[:: thinning(claimed, rate_hz or FOLDER_RATE_HZ, MAX_FRAMES)]
    if not 0 < len(wanted) <= MAX_FRAMES:
        return None  # whoever reads the frames says what is wrong, or that the file claims too much
    first = next(iter(source.read(range(1))))
    size = choose_size(first.size, control.size).target
    chosen = control.frames is not None
    return Planned(len(wanted), max(1, len(rig)), size, rate_hz, wanted.start, wanted.step, chosen)
