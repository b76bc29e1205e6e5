"""Gaussians as PLY, in the layout that 3DGS viewers read."""

from collections.abc import Sequence
from pathlib import Path

import torch

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
    data = _encode(gaussians)
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


def _fields(coefficients: int) -> list[str]:
    names = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"]
    names += [f"f_rest_{i}" for i in range(3 * (coefficients - 1))]
    return [*names, "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]


def _encode(gaussians: Gaussians) -> bytes:
    count, coefficients = gaussians.sh.shape[:2]
    properties = "".join(f"property float {name}\n" for name in _fields(coefficients))
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{properties}end_header\n"
    columns = [
        gaussians.means,
        torch.zeros_like(gaussians.means),
        gaussians.sh[:, 0],
        gaussians.sh[:, 1:].transpose(1, 2).reshape(count, 3 * (coefficients - 1)),
        gaussians.logit_opacities[:, None],
        gaussians.log_scales,
        torch.nn.functional.normalize(gaussians.quaternions, dim=-1),
    ]
    table = torch.cat([c.detach().cpu().float() for c in columns], dim=1).numpy()
    return header.encode("ascii") + table.astype("<f4").tobytes()


_PLY = Still("PLY", ".ply", PLY_KIND, _encode)
