"""A scene as COLMAP's text model with its pictures, which programs of 3D Gaussians start from."""

from pathlib import Path

from scipy.spatial.transform import Rotation

from dreamdrive.export.cameras.views import street_points, write_views
from dreamdrive.export.log import Retouch
from dreamdrive.files.kinds import COLMAP_KIND
from dreamdrive.files.output import new_folder
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene


def scene_to_colmap(
    scene: Scene,
    folder: Path,
    *,
    clip: Clip | None = None,
    blur: Retouch | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write ``images`` and ``sparse/0`` with ``cameras.txt``, ``images.txt`` and ``points3D.txt``.

    The world is that of the scene, in metres. Cameras are pinholes, one for each of the rig; COLMAP counts
    pixels as we do, from the corner of the first. Points are centres of what stands, in no track.

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
    with new_folder(folder, replace=replace, kind=COLMAP_KIND) as made:
        names = write_views(scene, clip, made / "images", progress, blur=blur)
        model = made / "sparse" / "0"
        model.mkdir(parents=True)
        (model / "cameras.txt").write_text(_cameras(scene))
        (model / "images.txt").write_text(_images(scene, names))
        (model / "points3D.txt").write_text(_points(scene))


def _cameras(scene: Scene) -> str:
    lines = ["# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"]
    rig = {
        scene.of_rig(i): camera for i, camera in reversed(list(enumerate(scene.cameras)))
    }  # the first of each
    for k, c in sorted(rig.items()):
        lines.append(f"{k + 1} PINHOLE {c.width_px} {c.height_px} {c.fx_px} {c.fy_px} {c.cx_px} {c.cy_px}")
    return "\n".join(lines) + "\n"


def _images(scene: Scene, names: list[str]) -> str:
    lines = ["# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME", "# POINTS2D[]"]
    for i, (camera, name) in enumerate(zip(scene.cameras, names, strict=True)):
        pose = camera.camera_from_world
        x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat().tolist()
        place = " ".join(map(repr, pose[:3, 3].tolist()))
        lines += [f"{i + 1} {w!r} {x!r} {y!r} {z!r} {place} {scene.of_rig(i) + 1} {name}", ""]
    return "\n".join(lines) + "\n"


def _points(scene: Scene) -> str:
    means_m, colours = street_points(scene)
    lines = ["# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]"]
    for i, (place, rgb) in enumerate(zip(means_m.tolist(), colours.tolist(), strict=True)):
        lines.append(f"{i + 1} {place[0]} {place[1]} {place[2]} {rgb[0]} {rgb[1]} {rgb[2]} 0")
    return "\n".join(lines) + "\n"
