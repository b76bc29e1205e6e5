"""Gaussians as binary glTF with KHR_gaussian_splatting."""

from collections.abc import Sequence
from pathlib import Path

from dreamdrive.data.splats.glb import pack_glb
from dreamdrive.export.stills import Still, left_out_of_stills, write_stills
from dreamdrive.files.kinds import GLB_KIND
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.scene import Scene

_GLB = Still("GLB", ".glb", GLB_KIND, pack_glb)


def scene_to_glb(
    scene: Scene,
    path: Path,
    *,
    times_s: Sequence[float] | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write a scene as GLB, with axes x right, y up, z back.

    One file for a name ending in ``.glb``, else a folder, see ``write_stills``. All numbers are float32;
    programs that do not know the extension show coloured points.

    Raises:
        InputError: The path cannot be written, or the times do not grow.
    """
    write_stills(scene, path, _GLB, times_s=times_s, replace=replace, progress=progress)


def left_out_of_glb(scene: Scene, path: Path) -> str:
    """What of a scene ``scene_to_glb`` finds no place for, in a sentence."""
    return left_out_of_stills(scene, path, _GLB)
