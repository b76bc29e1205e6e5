"""The prior of a recorded clip: the recording itself, with its appearance as features."""

from dreamdrive.data.frames.repeats import without_repeats
from dreamdrive.data.input import read_dataset
from dreamdrive.datasets.planned import planned_of
from dreamdrive.errors import InputError
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.protocol import Input, Prior
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import RecordingInput, fields_of


def replay(opened: Input, progress: Progress = silent) -> Clip:
    """Read a recording of any data set.

    Z_ref is ``features["appearance"]``, and what a file adds to it.
    """
    control = opened.control
    if control.path is None:
        raise InputError("the prior replay needs an input: a video or a folder of images")
    clip = without_repeats(read_dataset(control, opened.log), control.hold_out)
    if "appearance" in clip.features:
        return clip
    return clip.with_features(appearance=appearance(clip.frames, clip.valid))


REPLAY = Prior(
    name="replay",
    make=replay,
    takes=fields_of(RecordingInput) | {"trajectory"},
    recorded=True,
    gives="the frames as they are; poses, features and the path asked for, where they are given",
    about="a recording, or a video that another program made",
    licence="none but that of the recording",
    memory="that of the frames",
    plan=lambda opened: planned_of(opened.control, opened.log),
)
