"""The prior of a recorded clip: the recording itself, with its appearance as features."""

from typing import Any

from dreamdrive.data import read_clip
from dreamdrive.data.rig import is_rig, read_rig_clip
from dreamdrive.errors import InputError
from dreamdrive.prior.appearance import appearance
from dreamdrive.prior.protocol import Prior
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control


def replay(control: Control, progress: Progress = silent) -> Clip:
    """Read a video, a folder of images or the cameras of a rig.

    Z_ref is ``features["appearance"]``, and what a file adds to it.

    Raises:
        InputError: There is no input, or it cannot be used.
    """
    if control.path is None:
        raise InputError("the prior replay needs an input: a video or a folder of images")
    options: dict[str, Any] = {
        "frames": control.frames,
        "fps": control.fps,
        "size": control.size,
        "poses": control.poses,
        "trajectory": control.trajectory,
        "hold_out": control.hold_out,
    }
    of_one = {name: getattr(control, name) for name in ("intrinsics", "hfov_deg", "features")}
    if not is_rig(control.path):
        clip = read_clip(control.path, **options, **of_one)
    elif given := [name for name, value in of_one.items() if value is not None]:
        raise InputError(f"{control.path} has several cameras; {given[0]} is not taken for them")
    else:
        clip = read_rig_clip(control.path, **options)
    if "appearance" in clip.features:
        return clip
    return clip.with_features(appearance=appearance(clip.frames, clip.valid))


REPLAY = Prior(
    name="replay",
    make=replay,
    takes=frozenset(
        {
            *("path", "frames", "fps", "size", "intrinsics", "poses", "hfov_deg", "hold_out"),
            *("trajectory", "features"),
        }
    ),
    gives="the frames as they are; poses, features and the path asked for, where they are given",
    about="a recording, or a video that another program made",
    licence="none but that of the recording",
    memory="that of the frames",
)
