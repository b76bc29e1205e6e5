"""Gaussians as SPZ, a fifth of the size of PLY."""

from collections.abc import Sequence
from pathlib import Path

from dreamdrive.data.splats.spz import pack_spz
from dreamdrive.export.stills import Still, left_out_of_stills, write_stills
from dreamdrive.files.kinds import SPZ_KIND
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.scene import Scene

_SPZ = Still("SPZ", ".spz", SPZ_KIND, pack_spz)


def scene_to_spz(
    scene: Scene,
    path: Path,
    *,
    times_s: Sequence[float] | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write a scene as SPZ, with axes x right, y up, z back.

    One file for a name ending in ``.spz``, else a folder, see ``write_stills``. Positions are good to 0.12 mm
    within 2 km, logarithms of sizes to 1/32, opacities to 1/500, rotations to 0.3 degrees; colours are
    cut off at 3.3, their further coefficients at 1.

    Raises:
        InputError: The path cannot be written, or the times do not grow.
    """
    write_stills(scene, path, _SPZ, times_s=times_s, replace=replace, progress=progress)


def left_out_of_spz(scene: Scene, path: Path) -> str:
    """What of a scene ``scene_to_spz`` finds no place for, in a sentence."""
    return left_out_of_stills(scene, path, _SPZ)
