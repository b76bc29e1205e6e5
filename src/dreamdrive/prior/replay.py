"""The prior of a recorded clip: the recording itself, with its appearance as features."""

from pathlib import Path

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
    if is_rig(control.path):
        return _of_rig(control, control.path)
    clip = read_clip(
        control.path,
        frames=control.frames,
        fps=control.fps,
        size=control.size,
        intrinsics=control.intrinsics,
        poses=control.poses,
        hfov_deg=control.hfov_deg,
        trajectory=control.trajectory,
        features=control.features,
        hold_out=control.hold_out,
    )
    if "appearance" in clip.features:
        return clip
    return clip.with_features(appearance=appearance(clip.frames, clip.valid))


def _of_rig(control: Control, path: Path) -> Clip:
    """The frames of several cameras."""
    for name in ("intrinsics", "hfov_deg", "features"):
        if getattr(control, name) is not None:
            raise InputError(f"{path} has several cameras; {name} is not taken for them")
    clip = read_rig_clip(
        path,
        frames=control.frames,
        fps=control.fps,
        size=control.size,
        poses=control.poses,
        trajectory=control.trajectory,
        hold_out=control.hold_out,
    )
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
