"""A clip as a folder that ``replay`` takes up again (docs/replay.md).

- ``frames/NNNN.png``: the frames as they are; what holds no picture is transparent.
- ``video.mp4``: the same to look at; H.264 loses some colour, so that the pictures are what is read.
- ``intrinsics.json``: the pinhole, where it is known.
- ``poses.json``: the path, where it is known and in metres; ``requested.json``: the path that was asked for.
- ``features.safetensors``: the features.
- ``provenance.json``: where all this comes from.

Of several cameras each has ``frames`` and ``intrinsics.json`` in a folder ``cameraK``; ``rig.json`` tells how
they are mounted. Path and video are the first one's, features are left out.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive.data.cameras.poses import write_trajectory
from dreamdrive.data.feature_file import FeatureFile, write_features
from dreamdrive.data.formats.cameras import indexed_pinhole
from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.data.pictures.video_writer import write_video
from dreamdrive.data.rig import write_rig
from dreamdrive.files.json_file import write_json
from dreamdrive.files.kinds import RECORDING_KIND
from dreamdrive.files.output import new_folder
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.trajectory import Trajectory

ABOUT = "provenance.json"
_INTRINSICS = "intrinsics.json"


def write_recording(clip: Clip, folder: Path, about: dict[str, Any], *, replace: bool = False) -> None:
    """Write a clip of at least two frames; the folder appears whole or not at all.

    ``about`` goes into ``provenance.json`` beside the clip's own provenance. With ``replace`` it takes the
    place of an older folder of this kind. Features of too many channels raise ``ValueError``.
    """
    first = clip.only(int(clip.camera[0]))
    rate_hz = 1 / first.interval_s
    values = {
        **about,
        "fps": rate_hz,
        "frames": len(first),
        "cameras": len(clip.rig),
        "size": list(clip.size),
        "source_index": first.source_index.tolist(),
        "recorded": None if clip.recorded is None else asdict(clip.recorded),
        "log": None if clip.log is None else asdict(clip.log),
        "provenance": clip.provenance,
    }
    with new_folder(folder, replace=replace, kind=RECORDING_KIND) as made:
        if len(clip.rig) == 1:
            _write_camera(clip, made)
        else:
            _write_cameras(clip, made)
        write_video(made / "video.mp4", iter(first.frames), rate_hz)
        _write_path(first, made)
        if clip.features and len(clip.rig) == 1:
            write_features(made / "features.safetensors", FeatureFile(clip.features, values))
        write_json(made / ABOUT, values)


def _write_cameras(clip: Clip, folder: Path) -> None:
    mounted = {f"camera{index}": camera.world_from_camera for index, camera in enumerate(clip.rig)}
    for index, name in enumerate(mounted):
        (folder / name).mkdir()
        _write_camera(clip.only(index), folder / name)
    write_rig(mounted, folder, _INTRINSICS if clip.known.intrinsics else None)


def _write_camera(clip: Clip, folder: Path) -> None:
    """Frames, and the pinhole where it is known."""
    (folder / "frames").mkdir()
    for index in range(len(clip)):
        _write_frame(clip, index, folder / "frames" / f"{index:04d}.png")
    if clip.known.intrinsics:
        write_json(folder / _INTRINSICS, indexed_pinhole(clip.rig[0]))


def _write_frame(clip: Clip, index: int, path: Path) -> None:
    picture = clip.frames[index][..., ::-1]
    if not clip.valid.all():
        alpha = clip.valid[index][..., None].astype(np.uint8) * 255
        picture = np.concatenate([picture, alpha], axis=2)
    write_picture(path, picture)


def _write_path(clip: Clip, folder: Path) -> None:
    poses = clip.known.world_from_camera
    # Poses that a model was asked for tell nothing of its frames, and are in the request.
    if poses is not None and clip.known.metric and not clip.known.generated:
        write_trajectory(Trajectory(poses, clip.times_s), folder / "poses.json")
    if clip.requested is not None:
        write_trajectory(clip.requested, folder / "requested.json")
