"""One photo, several drives: a picture with a row for each."""

import numpy as np
from jaxtyping import UInt8

from dreamdrive.scene.scene import Scene
from dreamdrive.show import panels
from dreamdrive.splat import render_scene

_COLUMNS = 5


def draw_drives(scene: Scene) -> UInt8[np.ndarray, "h w 3"] | None:
    """What the scene shows at five times of each drive; None unless several begin at the same place."""
    if scene.camera is None:
        return None
    drives = [np.flatnonzero(scene.camera == camera) for camera in np.unique(scene.camera)]
    begins = [scene.cameras[views[0]].world_from_camera for views in drives]
    if any(not np.allclose(pose, begins[0], atol=1e-6) for pose in begins):
        return None
    images: dict[str, UInt8[np.ndarray, "h w 3"]] = {}
    for number, views in enumerate(drives):
        for share in np.linspace(0, 1, _COLUMNS):
            view = int(views[round(share * (len(views) - 1))])
            t_s = float(scene.times_s[view])
            seen = render_scene(scene, scene.cameras[view], t_s, of_rig=int(scene.camera[view]))
            images[f"drive {number + 1}, {t_s:.1f} s"] = seen.picture
    return panels.grid(images, columns=_COLUMNS)
