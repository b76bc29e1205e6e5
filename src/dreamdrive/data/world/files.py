"""Worlds on disk: what each camera records, and all truth beside it."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dreamdrive.data.layout_file import write_layout
from dreamdrive.data.layout_picture import draw_layout
from dreamdrive.data.world.drive import Drive
from dreamdrive.data.world.materials import Semantic
from dreamdrive.scene.atomic import new_folder


def write_world(drives: Mapping[str, Drive], path: Path, *, replace: bool = False) -> None:
    """Write a world folder; it appears whole or not at all.

    ``layout.json``, its drawing ``layout.png`` and ``classes.json`` (the semantic classes) lie in the folder
    itself. Of every camera there are: ``frames/NNNN.png``; ``meta.json`` (calibration for
    ``--intrinsics``; principal point by integer pixel index, as calibration files count); ``poses.json`` (a
    trajectory for ``--poses``); ``depth.npz`` (``depth_m``, 0 in the sky); ``flow.npz`` (``flow_px``, to the
    next frame); ``instances/NNNN.png``, ``semantics/NNNN.png``, ``moving/NNNN.png``, ``sky/NNNN.png``;
    ``boxes.json`` (hulls with a pose a frame, in the camera's world). One camera lies in the folder itself,
    several in folders of their names.

    Args:
        drives: One for each camera, by its name.
        path: The folder.
        replace: Whether an existing world folder may be replaced.

    Raises:
        InputError: Something else is at ``path``, or it cannot be written; what was there stays.
    """
    first = next(iter(drives.values()))
    if len(first.boxes) > 255:
        raise ValueError(f"world: {len(first.boxes)} boxes do not fit 8-bit labels")
    with new_folder(path, replace=replace, mark="layout.json") as folder:
        write_layout(first.world.layout, folder / "layout.json")
        seconds = float(first.times_s[-1])
        _write_png(folder / "layout.png", draw_layout(first.world.layout, seconds)[..., ::-1])
        _write_json(folder / "classes.json", {kind.name.lower(): int(kind) for kind in Semantic})
        for name, drive in drives.items():
            place = folder if len(drives) == 1 else folder / name
            place.mkdir(exist_ok=True)
            _write_camera(drive, place)


def _write_camera(drive: Drive, folder: Path) -> None:
    for name, images in (
        ("frames", drive.frames[..., ::-1]),
        ("instances", drive.instance.astype(np.uint8)),
        ("semantics", drive.semantic),
        ("moving", drive.moving.astype(np.uint8) * 255),
        ("sky", drive.sky.astype(np.uint8) * 255),
    ):
        (folder / name).mkdir()
        for i, image in enumerate(images):
            _write_png(folder / name / f"{i:04d}.png", image)
    np.savez_compressed(folder / "depth.npz", depth_m=drive.depth_m)
    np.savez_compressed(folder / "flow.npz", flow_px=drive.flow_px)
    _write_json(folder / "meta.json", _calibration(drive))
    path = drive.trajectory
    _write_json(
        folder / "poses.json",
        {"world_from_camera": path.world_from_camera.tolist(), "times_s": path.times_s.tolist()},
    )
    _write_json(
        folder / "boxes.json", {"boxes": _boxes(drive), "world_from_map": drive.world_from_map.tolist()}
    )


def _write_png(path: Path, image: np.ndarray) -> None:
    path.write_bytes(cv2.imencode(".png", image)[1].tobytes())


def _write_json(path: Path, values: dict[str, Any]) -> None:
    """Values as readable JSON without NaN."""
    path.write_text(json.dumps(values, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _calibration(drive: Drive) -> dict[str, Any]:
    camera = drive.cameras[0]
    intrinsics = {
        "fx": camera.fx_px,
        "fy": camera.fy_px,
        "cx": camera.cx_px - 0.5,
        "cy": camera.cy_px - 0.5,
    }
    return {"width": camera.width_px, "height": camera.height_px, "intrinsics": intrinsics}


def _boxes(drive: Drive) -> list[dict[str, Any]]:
    return [
        {
            "instance": box.instance,
            "id": box.id,
            "kind": box.kind,
            "moving": box.moving,
            "size_m": box.size_m.tolist(),
            "world_from_box": box.world_from_box.tolist(),
        }
        for box in drive.boxes
    ]
