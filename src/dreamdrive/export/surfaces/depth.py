"""Depth of every view as 16-bit pictures, with the pictures and cameras beside them."""

from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt16

from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.export.cameras.nerfstudio import frames_of
from dreamdrive.export.cameras.views import write_views
from dreamdrive.export.log import Retouch
from dreamdrive.export.surfaces.surface import surface_of
from dreamdrive.files.json_file import write_json
from dreamdrive.files.kinds import DEPTH_KIND
from dreamdrive.files.output import new_folder
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene

PER_METRE = 256
"""What a metre is in the pictures of depth, as in KITTI."""


def scene_to_depth(
    scene: Scene,
    folder: Path,
    *,
    clip: Clip | None = None,
    blur: Retouch | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write ``depth``, ``images`` and ``transforms.json``, a picture of each for every view.

    Depth is along z, in 16 bits as KITTI has it: the value over 256 in metres; 0 where there is none: in the
    sky, in holes, and from 256 m on. At outlines it is that of one side. Cameras
    and axes are those of nerfstudio, which takes ``depth_unit_scale_factor`` for the scale.

    Args:
        scene: The scene.
        folder: To write.
        clip: What the scene was made of, whose frames are written; without it the scene is rendered.
        blur: Changes each picture before it is written.
        replace: Take the place of an older folder of this kind.
        progress: Told of each picture.

    Raises:
        InputError: The folder cannot be written, or the clip is of another scene.
    """
    count = len(scene.cameras)
    with new_folder(folder, replace=replace, kind=DEPTH_KIND) as made:
        names = write_views(
            scene, clip, made / "images", lambda done, _: progress(done, 2 * count), blur=blur
        )
        for view, (camera, name) in enumerate(zip(scene.cameras, names, strict=True)):
            place = made / "depth" / name
            place.parent.mkdir(parents=True, exist_ok=True)
            write_picture(place, depth_picture(surface_of(scene, camera, float(scene.times_s[view])).depth_m))
            progress(count + view + 1, 2 * count)
        frames = frames_of(scene, [f"images/{name}" for name in names])
        for frame, name in zip(frames, names, strict=True):
            frame["depth_file_path"] = f"depth/{name}"
        about = {"camera_model": "PINHOLE", "depth_unit_scale_factor": 1 / PER_METRE, "frames": frames}
        write_json(made / "transforms.json", about)


def depth_picture(depth_m: Float[np.ndarray, "h w"]) -> UInt16[np.ndarray, "h w"]:
    """Depth as KITTI writes it, 0 where there is none or it is too large."""
    steps = np.rint(depth_m * PER_METRE)
    return np.where(steps > np.iinfo(np.uint16).max, 0, steps).astype(np.uint16)


def left_out_of_depth(scene: Scene, path: Path) -> str:
    """What of a scene ``scene_to_depth`` finds no place for, in a sentence."""
    return "Depth is in 1/256 m; 0 is sky, a hole, or 256 m and more."
