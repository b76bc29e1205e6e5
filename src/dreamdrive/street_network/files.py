"""Looks as files that other programs read (docs/reference/look.md)."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8, UInt16

from dreamdrive.data.formats.cameras import indexed_pinhole
from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.files.json_file import write_json
from dreamdrive.files.kinds import LOOK_KIND
from dreamdrive.files.output import new_folder
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.look import CameraEstimate, Look
from dreamdrive.scene.street.street_class import StreetClass

MARK = "look.json"
STEPS = 256
"""What a depth of one metre, or camera height, is in a 16-bit PNG."""
_FOLDERS = ("overview", "depth", "classes", "instances", "confidence", "arrays")


def write_look(
    look: Look,
    folder: Path,
    pictures: Iterable[UInt8[np.ndarray, "h w 3"]],
    frames: Sequence[dict[str, Any]],
    about: dict[str, Any],
    *,
    replace: bool = False,
) -> None:
    """Write what is seen; the folder appears whole or not at all.

    Args:
        look: What is seen.
        folder: Where to; an older one of this kind is replaced if that is asked for.
        pictures: The overview of each frame, RGB.
        frames: What else to say of each frame, as JSON values.
        about: The same of all.
        replace: Whether an older folder may be replaced.
    """
    metric = look.camera_height_m is not None
    depth = look.depth_m if metric else look.depth
    with new_folder(folder, replace=replace, kind=LOOK_KIND) as made:
        for name in _FOLDERS:
            (made / name).mkdir()
        for index, picture in enumerate(pictures):
            _write_frame(look, depth[index], index, picture, made)
        road_users = [[asdict(user) | {"kind": user.kind.name} for user in each] for each in look.road_users]
        cameras = [camera_values(each) for each in look.cameras]
        each_frame = zip(frames, cameras, road_users, strict=True)
        values = {
            **about,
            "depth_unit": f"1/{STEPS} {'m' if metric else 'camera height'}",
            "camera_height_m": look.camera_height_m,
            "classes": {each.name: int(each) for each in StreetClass},
            **indexed_pinhole(pinhole_of(look.camera)),
            "camera": camera_values(look.camera),
            "frames": [{**one, "camera": camera, "road_users": seen} for one, camera, seen in each_frame],
        }
        write_json(made / MARK, values)


def camera_values(camera: CameraEstimate) -> dict[str, float]:
    """A camera as JSON values."""
    return {
        **asdict(camera),
        "hfov_deg": float(np.degrees(camera.hfov_rad)),
        "pitch_rad": camera.pitch_rad,
    }


def pinhole_of(camera: CameraEstimate) -> Camera:
    """The pinhole that is estimated, at the identity."""
    width, height = camera.width_px, camera.height_px
    return Camera(camera.focal_px, camera.focal_px, width / 2, height / 2, width, height)


def depth_steps(depth: Float[np.ndarray, "h w"]) -> UInt16[np.ndarray, "h w"]:
    """Depth in steps of ``1 / STEPS``: 0 is where there is none, 65535 that far and all that is farther."""
    most = np.iinfo(np.uint16).max
    return np.where(depth > 0, np.rint(depth * STEPS).clip(1, most), 0).astype(np.uint16)


def _write_frame(look: Look, depth: Float[np.ndarray, "h w"], index: int, picture: Any, folder: Path) -> None:
    name = f"{index:04d}"
    sure = np.rint(255 * look.confidence[index].astype(np.float32)).astype(np.uint8)
    write_picture(folder / "overview" / f"{name}.png", picture[..., ::-1])
    write_picture(folder / "depth" / f"{name}.png", depth_steps(depth))
    write_picture(folder / "classes" / f"{name}.png", look.classes[index])
    write_picture(folder / "instances" / f"{name}.png", look.instances[index])
    write_picture(folder / "confidence" / f"{name}.png", sure)
    np.savez(
        folder / "arrays" / f"{name}.npz",
        depth=depth,
        spread=look.spread[index],
        classes=look.classes[index],
        confidence=look.confidence[index],
        instances=look.instances[index],
    )
