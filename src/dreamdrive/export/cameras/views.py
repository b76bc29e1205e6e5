"""Recorded views as pictures, and points of the street, as programs that reconstruct read them."""

from pathlib import Path

import cv2
import numpy as np
import torch
from jaxtyping import Float, UInt8

from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.export.log import Retouch
from dreamdrive.export.whole_log import check_clip
from dreamdrive.progress import Progress
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import SH_C0
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene

MOST_POINTS = 100_000
"""Of the street: what a fit starts from is no denser."""
_SOLID = 0.5


def write_views(
    scene: Scene, clip: Clip | None, folder: Path, progress: Progress, *, blur: Retouch | None = None
) -> list[str]:
    """Write each recorded view as PNG, and name the files below the folder, in the order of the views.

    Those of a rig have a folder each; for the pictures see ``picture_of_view``.
    """
    check_clip(scene, clip)
    names: list[str] = []
    for i in range(len(scene.cameras)):
        name = f"{i:05d}.png" if scene.camera is None else f"camera{scene.of_rig(i)}/{i:05d}.png"
        picture = picture_of_view(scene, clip, i, blur)
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_picture(folder / name, cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
        names.append(name)
        progress(i + 1, len(scene.cameras))
    return names


def picture_of_view(
    scene: Scene, clip: Clip | None, view: int, blur: Retouch | None
) -> UInt8[np.ndarray, "h w 3"]:
    """A recorded frame, of the clip that the scene was made of; without it the view is rendered."""
    if clip is None:
        of_rig, time_s = scene.of_rig(view), float(scene.times_s[view])
        picture = render_scene(scene, scene.cameras[view], time_s, of_rig=of_rig).picture
    else:
        picture = clip.frames[view]
    return picture if blur is None else blur(picture)


@torch.no_grad()
def street_points(scene: Scene) -> tuple[Float[np.ndarray, "n 3"], UInt8[np.ndarray, "n 3"]]:
    """Centres and colours of what stands and is solid, the most solid first, ``MOST_POINTS`` at most."""
    static = scene.static_at(float(scene.times_s[0]))
    opacity = torch.sigmoid(static.logit_opacities)
    order = torch.argsort(opacity, descending=True, stable=True)[:MOST_POINTS]
    solid = order[opacity[order] > _SOLID]
    colour = (static.sh[solid, 0] * SH_C0 + 0.5).clamp(0, 1)
    return static.means[solid].double().numpy(), colour.mul(255).round().to(torch.uint8).numpy()
