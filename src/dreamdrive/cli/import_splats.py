"""``dreamdrive import``: a file of 3D Gaussians as a scene."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from dreamdrive.cli.terminal.console import plain
from dreamdrive.errors import InputError
from dreamdrive.files.given import check_given, check_there
from dreamdrive.files.kinds import IMPORTED_KIND
from dreamdrive.files.output import check_free, check_place

_Up = Literal["x", "-x", "y", "-y", "z", "-z"]
_ENDINGS = ".ply", ".spz", ".glb"


def import_splats(
    file: Annotated[Positional[Path], arg(metavar="FILE")],
    *,
    output: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    cameras: Annotated[Path | None, arg(metavar="FILE|DIR", help_behavior_hint="")] = None,
    up: Annotated[_Up | None, arg(help_behavior_hint="")] = None,
    force: bool = False,
) -> None:
    """Read a file of 3D Gaussians as a scene in which nothing moves; all commands take it as any other.

    Gaussians with NaN, or numbers that cannot be drawn, are left out, which is said.

    Args:
        file: PLY as 3DGS writes it, SPZ of version 2 to 4, or GLB with KHR_gaussian_splatting.
        output: Folder of the scene.
        cameras: Views in the axes of the file: poses with times as TUM or JSON, or the folder of a COLMAP
            model; without it views stand around the Gaussians.
        up: The axis of the file that points up; -y of PLY and y of the others, where it is not given.
        force: Replace an imported scene that is there.
    """
    check_there(file, f"a file of 3D Gaussians: {', '.join(_ENDINGS)}")
    if file.suffix.lower() not in _ENDINGS:
        raise InputError(f"{file} ends in {file.suffix!r}; expected {', '.join(_ENDINGS)}")
    check_given(cameras=cameras)
    check_place(output, file)
    check_free(output, force, IMPORTED_KIND)
    from dreamdrive.data.splats.splat_scene import read_splat_scene
    from dreamdrive.files.output import new_folder
    from dreamdrive.stored import save_scene

    read = read_splat_scene(file, cameras=cameras, up=up)
    with new_folder(output, replace=force, kind=IMPORTED_KIND) as folder:
        save_scene(read.scene, folder / "scene")
    console = plain()
    console.print(f"{output} holds {len(read.scene.static)} Gaussians.")
    if read.dropped:
        console.print(f"{read.dropped} of the file cannot be drawn (NaN, or far beyond bounds): left out.")
    console.print(read.cameras)
