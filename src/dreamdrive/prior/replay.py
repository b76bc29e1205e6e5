"""The prior of a recorded clip: the recording itself, with its appearance as features."""

from dreamdrive.data import read_dataset
from dreamdrive.data.clip_reader import RECORDING
from dreamdrive.errors import InputError
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.protocol import Prior
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control


def replay(control: Control, progress: Progress = silent) -> Clip:
    """Read a recording of any data set.

    Z_ref is ``features["appearance"]``, and what a file adds to it.
    """
    if control.path is None:
        raise InputError("the prior replay needs an input: a video or a folder of images")
    clip = read_dataset(control)
    if "appearance" in clip.features:
        return clip
    return clip.with_features(appearance=appearance(clip.frames, clip.valid))


REPLAY = Prior(
    name="replay",
    make=replay,
    takes=RECORDING.takes | {"dataset", "scene", "cameras"},
    gives="the frames as they are; poses, features and the path asked for, where they are given",
    about="a recording, or a video that another program made",
    licence="none but that of the recording",
    memory="that of the frames",
)
