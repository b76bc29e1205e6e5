"""Drawn drives on disk: what each camera records, and all truth beside it."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np

from dreamdrive.data.formats.cameras import indexed_pinhole
from dreamdrive.data.layout_file import MOST_BOXES, write_layout
from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.data.rig import write_rig
from dreamdrive.data.truth_folder import depth_files
from dreamdrive.files.json_file import write_json
from dreamdrive.files.kinds import WORLD_KIND
from dreamdrive.files.output import new_folder
from dreamdrive.scene.street.truth import DriveTruth, Mount, Semantic
from dreamdrive.show import draw_layout
from streetworld.corruption import Corruption
from streetworld.drive import front_from_mount


def write_world(
    drives: Mapping[Mount, DriveTruth],
    path: Path,
    *,
    corruption: Corruption | None = None,
    replace: bool = False,
) -> None:
    """Write a world folder, with a drive for each camera; it appears whole or not at all.

    ``layout.json``, its drawing ``layout.png`` and ``classes.json`` (the semantic classes) lie in the folder
    itself. Of every camera there are: ``frames/NNNN.png``; ``cameras.json`` (calibration and poses, principal
    point by integer pixel index, what was done to the frames) and ``depth/NNNN.npz`` (``depth_m``, 0 in the
    sky), which together are what ``--geometry-files`` takes; ``poses.json`` (a trajectory for ``--poses``);
    ``flow.npz`` (``flow_px``, to the next frame); ``instances/NNNN.png``, ``semantics/NNNN.png``,
    ``moving/NNNN.png``, ``sky/NNNN.png``; ``boxes.json`` (hulls with a pose a frame, in the camera's world).
    One camera lies in the folder itself, several in folders of their names, with their mountings in
    ``rig.json``, see ``data.rig``.
    """
    first = next(iter(drives.values()))
    if len(first.boxes) > MOST_BOXES:
        raise ValueError(f"world: {len(first.boxes)} boxes do not fit 8-bit labels")
    with new_folder(path, replace=replace, kind=WORLD_KIND) as folder:
        write_layout(first.layout, folder / "layout.json")
        seconds = float(first.times_s[-1])
        write_picture(folder / "layout.png", draw_layout(first.layout, seconds)[..., ::-1])
        write_json(folder / "classes.json", {kind.name.lower(): int(kind) for kind in Semantic})
        if len(drives) > 1:
            write_rig({name: front_from_mount(first.layout, name) for name in drives}, folder, "cameras.json")
        for name, drive in drives.items():
            place = folder if len(drives) == 1 else folder / name
            place.mkdir(exist_ok=True)
            _write_camera(drive, place, corruption)


def _write_camera(drive: DriveTruth, folder: Path, corruption: Corruption | None) -> None:
    for name, images in (
        ("frames", drive.frames[..., ::-1]),
        ("instances", drive.instance.astype(np.uint8)),
        ("semantics", drive.semantic),
        ("moving", drive.moving.astype(np.uint8) * 255),
        ("sky", drive.sky.astype(np.uint8) * 255),
    ):
        (folder / name).mkdir()
        for i, image in enumerate(images):
            write_picture(folder / name / f"{i:04d}.png", image)
    (folder / "depth").mkdir()
    for place, depth_m in zip(depth_files(folder, len(drive.depth_m)), drive.depth_m, strict=True):
        np.savez_compressed(place, depth_m=depth_m)
    np.savez_compressed(folder / "flow.npz", flow_px=drive.flow_px)
    made = {} if corruption is None else {"corruption": asdict(corruption)}
    poses = {"world_from_camera": drive.trajectory.world_from_camera}
    boxes = [vars(box) for box in drive.boxes]
    write_json(folder / "cameras.json", {**indexed_pinhole(drive.cameras[0]), **poses, **made})
    write_json(folder / "poses.json", {**poses, "times_s": drive.times_s})
    write_json(folder / "boxes.json", {"boxes": boxes, "world_from_map": drive.world_from_map})
