"""New drives through a scene as videos, pictures or arrays."""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8, UInt16

from dreamdrive.compute.threads import ahead, one_torch_thread
from dreamdrive.data.formats.cameras import indexed_pinhole
from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.data.pictures.video_writer import write_video
from dreamdrive.drive import Drive, frame_rate
from dreamdrive.errors import InputError
from dreamdrive.files.output import new_folder
from dreamdrive.files.paths import inside
from dreamdrive.names import Format, Show
from dreamdrive.restore import Restorer
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.control import RATES_HZ
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.show import panels
from dreamdrive.show.videos import write_png
from dreamdrive.splat import SceneView, render_scene
from dreamdrive.trust import SceneTrust, TrustedView

NOTE = "render.json"
"""What lies beside pictures and arrays: calibration, poses and times."""
PER_METRE = 256
"""What a depth of one metre is in a 16-bit PNG, as in KITTI: up to 256 m in steps of 4 mm."""
_FILES = (".mp4", ".png", ".npz")


@dataclass(frozen=True)
class RenderOptions:
    """What is shown of a drive, and how it is kept: a video, or a folder with a file a frame.

    Without a size it is that of the recording, without a rate that of the drive.
    """

    show: Show = "colour"
    format: Format = "mp4"
    size: tuple[int, int] | None = None
    fps: float | None = None
    blur: Callable[[UInt8[np.ndarray, "h w 3"]], UInt8[np.ndarray, "h w 3"]] | None = None
    """Changes each picture of colours before it is written."""


def write_drive(
    path: Path,
    scene: Scene,
    drive: Drive,
    options: RenderOptions,
    progress: Callable[[int], None],
    trust: SceneTrust | None = None,
    restorer: Restorer | None = None,
) -> None:
    """Render a drive and write it; the result appears when it is whole, in place of one from here.

    A video holds colours; depth has those of ``drive.panels``, and pictures fade to red where they are not to
    be believed if trust is to be shown, which is that of the scene. A folder holds one file a frame:
    ``NNNN.png``, 8-bit RGB or depth in 16 bits (see ``depth_png``), or ``NNNN.npz``: ``colour`` float32 (H,
    W, 3) in [0, 1], not of depth alone; ``depth_m`` float32 (H, W) in metres along z, 0 where there is
    nothing; ``alpha`` float32 (H, W), the share of the pixel that Gaussians cover; ``trust`` float32 (H // 8,
    W // 8), where it is shown, of blocks of pixels. ``render.json`` beside them has calibration, poses, times
    and the PSNR to expect where trust is shown. A restorer mends the colours. One frame is held at a time,
    with a restorer three. ``progress`` is called with the number of frames done.
    """
    camera = view_camera(scene.cameras[0], options.size)
    part = options.show if options.show in ("dynamic", "static") else "all"
    trust = (trust or SceneTrust.of(scene)) if options.show == "trust" else None
    expected_db: list[float] = []

    def seen_at(place: tuple[Camera, float]) -> SceneView | TrustedView:
        if restorer is not None:
            return restorer.view(*place)
        return render_scene(scene, *place, part=part) if trust is None else trust.view(*place)

    def views() -> Iterator[SceneView | TrustedView]:
        path = drive.path
        places = [(camera.at(path.world_from_camera[i]), float(path.times_s[i])) for i in range(len(path))]
        # The core splats with all threads; what torch and NumPy do for a restorer takes one.
        with nullcontext() if restorer is None else one_torch_thread():
            shown = map(seen_at, places) if restorer is None else ahead(seen_at, places)
            for i, seen in enumerate(shown):
                if isinstance(seen, TrustedView):
                    expected_db.append(seen.psnr_db)
                yield seen
                progress(i + 1)

    if options.format == "mp4":
        write_video(path, (_picture(view, options) for view in views()), video_rate(drive, options))
        return
    with new_folder(path, replace=True, kind="rendered drive") as folder:
        for i, view in enumerate(views()):
            _write_frame(folder / f"{i:04d}.{options.format}", view, options)
        note = _note(camera, drive.path, options)
        if expected_db:
            note["expected_psnr_db"] = expected_db
        (folder / NOTE).write_text(json.dumps(note, allow_nan=False) + "\n")


def frames(
    scene: Scene, trajectory: Trajectory, size: tuple[int, int] | None = None
) -> UInt8[np.ndarray, "t h w 3"]:
    """What the first recorded camera sees along a path, see ``Scene.render``."""
    camera = view_camera(scene.cameras[0], size)
    views = zip(trajectory.world_from_camera, trajectory.times_s, strict=True)
    return np.stack([render_scene(scene, camera.at(pose), float(t_s)).picture for pose, t_s in views])


def video_rate(drive: Drive, options: RenderOptions) -> float:
    """Frames a second of a video of a drive, within ``RATES_HZ``."""
    rate = frame_rate(drive.path) if options.fps is None else options.fps
    if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
        raise InputError(
            f"--trajectory {drive.name} has {rate:.3g} poses a second, and a video {RATES_HZ[0]:g} to "
            f"{RATES_HZ[1]:g} frames: give --fps"
        )
    return rate


def view_camera(camera: Camera, size: tuple[int, int] | None) -> Camera:
    """A camera at another size: the same horizontal field of view and shape of pixels.

    The principal point keeps its share of the width and of the height: a higher picture of the same width
    shows more above and below.
    """
    if size is None:
        return camera
    (width, height), scale = size, size[0] / camera.width_px
    return replace(camera.resized(width, height), fx_px=camera.fx_px * scale, fy_px=camera.fy_px * scale)


def depth_png(view: SceneView) -> UInt16[np.ndarray, "h w"]:
    """Depth along z in 16 bits, in units of ``1 / PER_METRE`` metres.

    0 is where there is nothing, 65535 is 256 m and all that is farther.
    """
    depth = np.rint(np.minimum(view.depth_m.numpy() * PER_METRE, np.iinfo(np.uint16).max))
    return depth.astype(np.uint16)


def _picture(shown: SceneView | TrustedView, options: RenderOptions) -> UInt8[np.ndarray, "h w 3"]:
    view = shown.view if isinstance(shown, TrustedView) else shown
    if options.show == "depth":
        return panels.depth_colours(view.depth_m.numpy())
    picture = view.picture if options.blur is None else options.blur(view.picture)
    return panels.trust_colours(picture, shown.trust) if isinstance(shown, TrustedView) else picture


def _write_frame(path: Path, shown: SceneView | TrustedView, options: RenderOptions) -> None:
    view = shown.view if isinstance(shown, TrustedView) else shown
    if path.suffix == ".npz":
        # Compressing would save a quarter of the space and take ten times as long.
        arrays = {"depth_m": view.depth_m.numpy(), "alpha": view.alpha.numpy()}
        if options.show != "depth":
            arrays["colour"] = view.colour.numpy()
        if isinstance(shown, TrustedView):
            arrays["trust"] = shown.trust.astype(np.float32)
        np.savez(path, allow_pickle=False, **arrays)
    elif options.show == "depth":
        write_picture(path, depth_png(view))
    else:
        write_png(path, _picture(shown, options))


def _note(camera: Camera, drive: Trajectory, options: RenderOptions) -> dict[str, Any]:
    """Calibration as ``--intrinsics`` reads it (pixels by integer index), path as ``--trajectory`` does."""
    unit = {"depth_unit": f"1/{PER_METRE} m"} if (options.show, options.format) == ("depth", "png") else {}
    return {
        "show": options.show,
        **unit,
        **indexed_pinhole(camera),
        "world_from_camera": drive.world_from_camera.tolist(),
        "times_s": drive.times_s.tolist(),
    }


def places(out: Path, output: Path | None, drives: Sequence[Drive], options: RenderOptions) -> list[Path]:
    """Where each drive goes: ``-o``, or ``video`` in the output folder, where no link leads elsewhere.

    ``-o`` is the result of a single drive, or the folder for those of several. What is not all colours is
    part of the default name.
    """
    if output is not None:
        _check_place(out, output)
        if len(drives) == 1:
            return [_single(output, options)]
        if output.suffix.lower() in _FILES:
            raise InputError(
                f"-o {output}: expected a folder for {len(drives)} trajectories, not the name of a file"
            )
    kind = "" if options.show == "colour" else f"_{options.show}"
    kind += {"mp4": ".mp4", "png": "", "npz": "_npz"}[options.format]
    names = [f"{drive.name}{kind}" for drive in drives]
    if output is not None:
        return [inside(output, name) for name in names]
    return [inside(out, f"video/{name}") for name in names]


def _single(output: Path, options: RenderOptions) -> Path:
    if options.format == "mp4" and output.suffix.lower() != ".mp4":
        raise InputError(f"-o {output}: expected a name that ends in .mp4")
    if options.format != "mp4" and output.suffix.lower() in _FILES:
        raise InputError(
            f"-o {output}: expected a folder for --format {options.format}, not the name of a file"
        )
    if output.name in ("", ".."):
        raise InputError(f"-o {output}: expected the name of a new folder")
    return output


def _check_place(out: Path, output: Path) -> None:
    """What lies among its results stops ``generate`` from working there again."""
    place, home = (Path(os.path.realpath(path)) for path in (output, out))
    if place.is_relative_to(home) and not place.is_relative_to(home / "video"):
        raise InputError(
            f"-o {output} lies in {out}, where generate would refuse to go on beside it; choose "
            f"{out / 'video'} or another place"
        )
