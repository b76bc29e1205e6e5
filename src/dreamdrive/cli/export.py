"""``dreamdrive export``: a scene in another program's format."""

from pathlib import Path
from typing import Annotated

from rich.console import Console
from tyro.conf import Positional, arg

from dreamdrive.choices import ExportKind
from dreamdrive.cli.scene import open_scene


def export(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    to: ExportKind,
    output: Annotated[Path, arg(aliases=["-o"], metavar="FILE|DIR")],
) -> None:
    """Write a scene in a format that other programs read.

    Args:
        out: The folder that generate wrote.
        to: ply is what viewers of 3D Gaussians read.
        output: NAME.ply for everything at the first recorded time; else a folder for static.ply and, with
            everything at each recorded time, frames/NNNN.ply.
    """
    from dreamdrive.export import export as write
    from dreamdrive.export import left_out_of_ply

    scene, console = open_scene(out), Console(highlight=False, markup=False)
    write(scene, to, output)
    console.print(str(output), soft_wrap=True)
    console.print(left_out_of_ply(scene, output), soft_wrap=True)
