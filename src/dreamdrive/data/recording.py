"""A clip as a folder that ``replay`` takes up again (docs/replay.md).

- ``frames/NNNN.png``: the frames as they are; what holds no picture is transparent.
- ``video.mp4``: the same to look at; H.264 loses some colour, so that the pictures are what is read.
- ``intrinsics.json``: the pinhole, where it is known.
- ``poses.json``: the path, where it is known and in metres; ``requested.json``: the path that was asked for.
- ``features.safetensors``: the features.
- ``provenance.json``: where all this comes from.
"""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dreamdrive.data.feature_file import FeatureFile, write_features
from dreamdrive.data.poses import write_trajectory
from dreamdrive.data.video_writer import write_video
from dreamdrive.scene.atomic import new_folder
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.trajectory import Trajectory

ABOUT = "provenance.json"
"""By this file a folder of this kind is known."""


def rate_hz(clip: Clip) -> float:
    """Frames a second, the median where they are not even."""
    return float(1 / np.median(np.diff(clip.times_s)))


def write_recording(clip: Clip, folder: Path, about: dict[str, Any], *, replace: bool = False) -> None:
    """Write a clip of one camera; the folder appears whole or not at all.

    Args:
        clip: The clip, of at least two frames.
        folder: Where to.
        about: JSON values for ``provenance.json``, beside the clip's own provenance.
        replace: Whether an older folder of this kind may be replaced.

    Raises:
        InputError: Something is in the way, or the place cannot be written.
        ValueError: The clip has several cameras, or features with too many channels.
    """
    if len(clip.rig) > 1:
        raise ValueError(f"a recording is of one camera, not {len(clip.rig)}")
    values = {
        **about,
        "fps": rate_hz(clip),
        "frames": len(clip),
        "size": list(clip.size),
        "source_index": clip.source_index.tolist(),
        "provenance": clip.provenance,
    }
    with new_folder(folder, replace=replace, mark=ABOUT) as made:
        (made / "frames").mkdir()
        for index in range(len(clip)):
            _write_frame(clip, index, made / "frames" / f"{index:04d}.png")
        write_video(made / "video.mp4", iter(clip.frames), rate_hz(clip))
        _write_geometry(clip, made)
        if clip.features:
            write_features(made / "features.safetensors", FeatureFile(clip.features, values))
        _write_json(made / ABOUT, values)


def _write_frame(clip: Clip, index: int, path: Path) -> None:
    picture = clip.frames[index][..., ::-1]
    if not clip.valid.all():
        alpha = clip.valid[index][..., None].astype(np.uint8) * 255
        picture = np.concatenate([picture, alpha], axis=2)
    path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())


def _write_geometry(clip: Clip, folder: Path) -> None:
    camera = clip.rig[0]
    if clip.known.intrinsics:
        # The file counts pixels by integer index.
        numbers = {"fx": camera.fx_px, "fy": camera.fy_px, "cx": camera.cx_px - 0.5, "cy": camera.cy_px - 0.5}
        size = {"width": camera.width_px, "height": camera.height_px}
        _write_json(folder / "intrinsics.json", {**size, "intrinsics": numbers})
    if clip.known.world_from_camera is not None and clip.known.metric:
        write_trajectory(Trajectory(clip.known.world_from_camera, clip.times_s), folder / "poses.json")
    if clip.requested is not None:
        write_trajectory(clip.requested, folder / "requested.json")


def _write_json(path: Path, values: dict[str, Any]) -> None:
    path.write_text(json.dumps(values, indent=1, allow_nan=False) + "\n", encoding="utf-8")
