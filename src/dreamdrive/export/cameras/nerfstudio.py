"""A scene as nerfstudio reads it: ``transforms.json``, pictures, and points to start from."""

import struct
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive.export.cameras.views import street_points, write_views
from dreamdrive.export.log import Retouch
from dreamdrive.files.json_file import write_json
from dreamdrive.files.kinds import NERFSTUDIO_KIND
from dreamdrive.files.output import new_folder
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene

_FLIPPED = np.diag([1.0, -1.0, -1.0, 1.0])
"""From OpenGL's axes of a camera, x right, y up, z backward, to ours."""
_POINTS = "points.ply"


def scene_to_nerfstudio(
    scene: Scene,
    folder: Path,
    *,
    clip: Clip | None = None,
    blur: Retouch | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write ``transforms.json``, ``images`` and ``points.ply``; arguments as of ``scene_to_colmap``.

    The world is that of the scene, in metres. ``time`` is each frame's in seconds. Frames that no fit of ours
    has seen are those of ``test_filenames``.
    """
    with new_folder(folder, replace=replace, kind=NERFSTUDIO_KIND) as made:
        names = [f"images/{name}" for name in write_views(scene, clip, made / "images", progress, blur=blur)]
        withheld = scene.held_out.tolist()
        write_json(
            made / "transforms.json",
            {
                "camera_model": "PINHOLE",
                "ply_file_path": _POINTS,
                "train_filenames": [name for name, held in zip(names, withheld, strict=True) if not held],
                "test_filenames": [name for name, held in zip(names, withheld, strict=True) if held],
                "frames": frames_of(scene, names),
            },
        )
        (made / _POINTS).write_bytes(_points(scene))


def frames_of(scene: Scene, names: list[str]) -> list[dict[str, Any]]:
    """The views of a scene as ``transforms.json`` lists them, by the names of their pictures."""
    return [
        {
            "file_path": name,
            "transform_matrix": camera.world_from_camera @ _FLIPPED,
            "time": time_s,
            "fl_x": camera.fx_px,
            "fl_y": camera.fy_px,
            "cx": camera.cx_px,
            "cy": camera.cy_px,
            "w": camera.width_px,
            "h": camera.height_px,
        }
        for name, camera, time_s in zip(names, scene.cameras, scene.times_s.tolist(), strict=True)
    ]


def _points(scene: Scene) -> bytes:
    """PLY of places and colours."""
    means_m, colours = street_points(scene)
    fields = [f"property float {axis}" for axis in "xyz"]
    fields += [f"property uchar {colour}" for colour in ("red", "green", "blue")]
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(means_m)}", *fields, "end_header"]
    rows = (struct.pack("<3f3B", *p, *c) for p, c in zip(means_m.tolist(), colours.tolist(), strict=True))
    return ("\n".join(head) + "\n").encode("ascii") + b"".join(rows)
