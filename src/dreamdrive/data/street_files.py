"""The procedural street on disk: frames, calibration, poses, depth, labels and boxes."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dreamdrive.data.street import Street
from dreamdrive.scene.atomic import new_folder


def write_world(street: Street, path: Path, *, replace: bool = False) -> None:
    """Write a world folder; it appears whole or not at all.

    ``frames/NNNN.png``; ``meta.json`` (calibration for ``--intrinsics``; principal point by integer pixel
    index, as calibration files count); ``poses.json`` (a trajectory for ``--poses``); ``depth.npz``
    (``depth_m``, 0 in the sky); ``instances/NNNN.png`` (8-bit labels, 0 for backdrop and sky);
    ``sky/NNNN.png``; ``boxes.json`` (hulls with a pose a frame and whether they move).

    Args:
        street: What to write; at most 255 parked and moving things.
        path: The folder.
        replace: Whether an existing world folder may be replaced.

    Raises:
        InputError: Something else is at ``path``, or it cannot be written; what was there stays.
    """
    if len(street.boxes) > 255:
        raise ValueError(f"street: {len(street.boxes)} things do not fit 8-bit labels")
    with new_folder(path, replace=replace, mark="meta.json") as folder:
        for name, images in (
            ("frames", street.frames[..., ::-1]),
            ("instances", street.instance.astype(np.uint8)),
            ("sky", street.sky.astype(np.uint8) * 255),
        ):
            (folder / name).mkdir()
            for i, image in enumerate(images):
                (folder / name / f"{i:04d}.png").write_bytes(cv2.imencode(".png", image)[1].tobytes())
        np.savez_compressed(folder / "depth.npz", depth_m=street.depth_m)
        _write_json(folder / "meta.json", _calibration(street))
        _write_json(folder / "poses.json", _trajectory(street))
        _write_json(folder / "boxes.json", {"boxes": _boxes(street)})


def _write_json(path: Path, values: dict[str, Any]) -> None:
    path.write_text(json.dumps(values, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _calibration(street: Street) -> dict[str, Any]:
    camera = street.cameras[0]
    intrinsics = {
        "fx": camera.fx_px,
        "fy": camera.fy_px,
        "cx": camera.cx_px - 0.5,
        "cy": camera.cy_px - 0.5,
    }
    return {"width": camera.width_px, "height": camera.height_px, "intrinsics": intrinsics}


def _trajectory(street: Street) -> dict[str, Any]:
    drive = street.trajectory
    return {"world_from_camera": drive.world_from_camera.tolist(), "times_s": drive.times_s.tolist()}


def _boxes(street: Street) -> list[dict[str, Any]]:
    return [
        {
            "instance": box.instance,
            "kind": box.kind,
            "moving": box.moving,
            "size_m": box.size_m.tolist(),
            "world_from_box": box.world_from_box.tolist(),
        }
        for box in street.boxes
    ]
