"""``dreamdrive export``: a scene in another program's format."""

from functools import partial
from pathlib import Path
from typing import Annotated

from rich.console import Console
from tyro.conf import Positional, arg

from dreamdrive.choices import ExportKind
from dreamdrive.cli.progress import Bars
from dreamdrive.cli.scene import open_scene


def export(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    to: ExportKind,
    output: Annotated[Path, arg(aliases=["-o"], metavar="FILE|DIR")],
    force: bool = False,
) -> None:
    """Write a scene or a drawn street in a format that other programs read.

    Args:
        out: The folder that generate wrote; for nuscenes also one of world make.
        to: ply is what viewers of 3D Gaussians read; nuscenes a data set with pictures, labels and lidar.
        output: For ply NAME.ply for everything at the first recorded time; else a folder for static.ply and,
            with everything at each recorded time, frames/NNNN.ply. For nuscenes a folder.
        force: Replace a data set that is there already.
    """
    console = Console(highlight=False, markup=False, soft_wrap=True)
    if to == "nuscenes":
        _export_nuscenes(out, output, force)
        console.print(str(output))
        return
    from dreamdrive.export import export_ply, left_out_of_ply

    scene = open_scene(out)
    export_ply(scene, output)
    console.print(str(output))
    console.print(left_out_of_ply(scene, output))


def _export_nuscenes(out: Path, output: Path, force: bool) -> None:
    from dreamdrive.data.nuscenes import MARK
    from dreamdrive.export import export_scene, export_world
    from dreamdrive.files.atomic import check_free
    from dreamdrive.world import is_world, read_drives

    check_free(output, force, MARK)
    with Bars(Console()) as bars:
        said = partial(bars, "nuscenes")
        if is_world(out):
            export_world(read_drives(out), out.resolve().name, output, replace=force, progress=said)
        else:
            export_scene(open_scene(out), output, replace=force, progress=said)
