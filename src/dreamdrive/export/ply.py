"""Gaussians as PLY, in the layout that 3DGS viewers read."""

from collections.abc import Sequence
from pathlib import Path

from dreamdrive.data.splats.ply import pack_ply
from dreamdrive.export.stills import Still, left_out_of_stills, write_stills
from dreamdrive.files.kinds import PLY_KIND
from dreamdrive.files.output import new_file
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene


def write_ply(gaussians: Gaussians, path: Path) -> None:
    """Write one PLY: float32, little endian, the fields and order of 3DGS.

    x y z, nx ny nz (0), f_dc_0..2, f_rest_* (channel-major, as many as the degree has), opacity (logit),
    scale_0..2 (log), rot_0..3 (wxyz, unit). Axes stay: x right, y down, z forward. Life spans, actors,
    features and source frames have no field and are left out; use ``Scene.at`` first for a scene at a time.
    """
    data = pack_ply(gaussians)
    with new_file(path) as partial:
        partial.write_bytes(data)


def export_ply(
    scene: Scene,
    path: Path,
    *,
    times_s: Sequence[float] | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write a scene as PLY: one file for a name ending in ``.ply``, else a folder, see ``write_stills``.

    The sequence ``frames/NNNN.ply`` is what viewers play. PLY has no place for sky and exposure. One Gaussian
    takes 68 bytes, with spherical harmonics of degree 1 104. What is there already is replaced only if that
    is asked for.
    """
    write_stills(scene, path, _PLY, times_s=times_s, replace=replace, progress=progress)


def left_out_of_ply(scene: Scene, path: Path) -> str:
    """What of a scene ``export_ply`` finds no place for, in a sentence."""
    return left_out_of_stills(scene, path, _PLY)


_PLY = Still("PLY", ".ply", PLY_KIND, pack_ply)
