"""Optical flow from each frame to the next, as KITTI writes it."""

import shutil
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, UInt16

from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.errors import InputError
from dreamdrive.export.cameras.views import picture_of_view
from dreamdrive.export.log import Retouch
from dreamdrive.export.surfaces.surface import Surface, surface_of
from dreamdrive.export.whole_log import check_clip
from dreamdrive.files.kinds import FLOW_KIND
from dreamdrive.files.output import new_folder
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.camera import NEAR_M
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene

_PER_PIXEL, _MIDDLE = 64, 1 << 15
"""KITTI's flow in 16 bits: 0 is in the middle, in steps of 1/64 pixel."""
_FARTHEST_PX = (_MIDDLE - 1) / _PER_PIXEL
_MARGIN = 0.05
"""How much nearer, as a share, something must be to hide a point."""


def scene_to_flow(
    scene: Scene,
    folder: Path,
    *,
    clip: Clip | None = None,
    blur: Retouch | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write ``training`` as KITTI 2015 has it: ``image_2``, ``flow_occ`` and ``flow_noc``.

    Of pair N are ``N_10.png`` and ``N_11.png``, a frame of the first camera and the next, and the flow of the
    first in 16 bits: columns, rows, and whether it is known. What stands moves by the camera, what moves by
    its motion, the sky as if it were infinitely far. ``flow_noc`` leaves out what the next frame does not
    show: what is hidden there, or outside. Unknown are holes and flow from 512 pixels on.

    Args:
        scene: The scene.
        folder: To write.
        clip: What the scene was made of, whose frames are written; without it the scene is rendered.
        blur: Changes each picture before it is written.
        replace: Take the place of an older folder of this kind.
        progress: Told of each pair.

    Raises:
        InputError: The folder cannot be written, there is one frame only, or the clip is of another scene.
    """
    check_clip(scene, clip)
    views = scene.front.tolist()
    if len(views) < 2:
        raise InputError("the drive has one frame, and flow leads from one to the next; give more")
    with new_folder(folder, replace=replace, kind=FLOW_KIND) as made:
        places = {name: made / "training" / name for name in ("image_2", "flow_occ", "flow_noc")}
        for place in places.values():
            place.mkdir(parents=True)
        now: Surface | None = None
        one = places["image_2"]
        for pair, view in enumerate(views):
            one, before = places["image_2"] / f"{pair:06d}_10.png", f"{pair - 1:06d}"
            write_picture(one, picture_of_view(scene, clip, view, blur)[..., ::-1])
            until_s = float(scene.times_s[views[min(pair + 1, len(views) - 1)]])
            then = surface_of(scene, scene.cameras[view], float(scene.times_s[view]), until_s)
            if now is not None:
                shutil.copyfile(one, places["image_2"] / f"{before}_11.png")
                flow_px, known, shown = flow_between(now, then)
                write_picture(places["flow_occ"] / f"{before}_10.png", _encoded(flow_px, known))
                write_picture(places["flow_noc"] / f"{before}_10.png", _encoded(flow_px, known & shown))
                progress(pair, len(views) - 1)
            now = then
        one.unlink()  # of the last frame nothing leads on


def flow_between(
    now: Surface, then: Surface
) -> tuple[Float[np.ndarray, "h w 2"], Bool[np.ndarray, "h w"], Bool[np.ndarray, "h w"]]:
    """Flow in pixels, columns and rows, from one surface to a later one of the same pinhole.

    And where it is known, and where the later one shows what it leads to.
    """
    camera = now.camera
    rays = camera.rays()
    seen = now.depth_m > 0
    world = (rays * now.depth_m[..., None]) @ camera.world_from_camera[:3, :3].T
    world += camera.world_from_camera[:3, 3] + now.way_m - then.camera.world_from_camera[:3, 3]
    world = np.where(seen[..., None], world, rays @ camera.world_from_camera[:3, :3].T)
    local = world @ then.camera.world_from_camera[:3, :3]
    z = local[..., 2]
    ahead = np.asarray(z > NEAR_M)
    focal, centre = np.array([camera.fx_px, camera.fy_px]), np.array([camera.cx_px, camera.cy_px])
    at_px = local[..., :2] / np.where(ahead, z, 1.0)[..., None] * focal + centre
    flow_px = at_px - (rays[..., :2] * focal + centre)
    known = (seen | now.beyond) & ahead & (np.abs(flow_px).max(axis=-1) < _FARTHEST_PX)
    return flow_px, known, _shown(then, at_px, np.where(seen, z, np.inf))


def _shown(
    then: Surface, at_px: Float[np.ndarray, "h w 2"], z_m: Float[np.ndarray, "h w"]
) -> Bool[np.ndarray, "h w"]:
    """Which points lie in the picture, and not behind all four pixels around them."""
    height, width = then.depth_m.shape
    inside = np.asarray(((at_px >= 0) & (at_px < (width, height))).all(axis=-1))
    depth_m = np.where(then.depth_m > 0, then.depth_m, np.inf)
    low = np.floor(np.where(inside[..., None], at_px, 0.5) - 0.5).astype(int)
    farthest_m = np.zeros(z_m.shape)
    for down in (0, 1):
        for right in (0, 1):
            row = np.clip(low[..., 1] + down, 0, height - 1)
            column = np.clip(low[..., 0] + right, 0, width - 1)
            farthest_m = np.maximum(farthest_m, depth_m[row, column])
    return inside & (z_m <= farthest_m * (1 + _MARGIN))


def _encoded(
    flow_px: Float[np.ndarray, "h w 2"], known: Bool[np.ndarray, "h w"]
) -> UInt16[np.ndarray, "h w 3"]:
    """Channels as OpenCV writes them: known, rows, columns, which a reader of RGB has the other way round."""
    steps = np.where(known[..., None], np.rint(flow_px * _PER_PIXEL) + _MIDDLE, 0)
    return np.dstack([known, steps[..., 1], steps[..., 0]]).astype(np.uint16)


def left_out_of_flow(scene: Scene, path: Path) -> str:
    """What of a scene ``scene_to_flow`` finds no place for, in a sentence."""
    others = "" if scene.camera is None else ", none of the other cameras"
    return f"Flow leads to the next frame: none of holes, none of 512 pixels and more{others}."
