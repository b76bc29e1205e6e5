"""``dreamdrive export``: a scene in another program's format."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.console import Console
from tyro.conf import Positional, arg

from dreamdrive.cli.scene import open_scene
from dreamdrive.cli.terminal.arguments import ExportName
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.export import EXPORTS, Export, function
from dreamdrive.files.given import SCENE, check_there

if TYPE_CHECKING:
    from dreamdrive.scene.clip import Clip
    from dreamdrive.scene.geometry import Geometry
    from dreamdrive.scene.scene import Scene

_OF_WORLD = "Pictures, poses and boxes are those of the drawn street."


def export(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    to: ExportName,
    output: Annotated[Path, arg(aliases=["-o"], metavar="FILE|DIR")],
    force: bool = False,
) -> None:
    """Write a scene or a drawn street in a format that other programs read.

    Args:
        out: The folder that generate wrote; for nuscenes, ncore and mcap also one of world make.
        to: ply is what viewers of 3D Gaussians read; nuscenes a data set with pictures, labels and lidar;
            ncore the clip with its poses for NuRec, 3dgrut and gsplat; mcap the drive for Foxglove; colmap
            and nerfstudio the frames with cameras and points; tum the path of the first camera.
        output: For ply NAME.ply for everything at the first recorded time; else a folder for static.ply and,
            with everything at each recorded time, frames/NNNN.ply. For mcap NAME.mcap, for tum NAME.txt; for
            the others a folder.
        force: Replace what is there already, if dreamdrive wrote it.
    """
    check_there(out, SCENE)
    chosen = EXPORTS.choose(to)
    chosen.check(output, force)
    said = _written(chosen, to, out, output, force)
    Console(highlight=False, markup=False, soft_wrap=True).print("\n".join([str(output), *said]))


def _written(chosen: Export, to: str, out: Path, output: Path, force: bool) -> list[str]:
    """Write it, and say what it holds."""
    from dreamdrive.data.truth_folder import is_world, read_drives
    from dreamdrive.run import stages_of

    pictures = "clip" in chosen.takes
    with Bars(Console()) as bars:
        how: dict[str, Any] = {"replace": force, "progress": partial(bars, to)}
        if chosen.world is not None and is_world(out):
            named = {"name": out.resolve().name} if "name" in chosen.takes else {}
            function(chosen.world)(read_drives(out), output, **named, **how)
            return [_OF_WORLD] if pictures else []
        scene, stages = open_scene(out), stages_of(out)
        clip, geometry = _kept(stages, scene) if pictures else (None, None)
        kept: dict[str, object] = {"clip": clip, "geometry": geometry}
        how |= {name: kept[name] for name in chosen.takes & set(kept)}
        function(chosen.scene)(scene, output, **how)
    said = [] if chosen.left_out is None else [function(chosen.left_out)(scene, output)]
    return [*said, _of_pictures(clip, stages)] if pictures else said


def _of_pictures(clip: "Clip | None", stages: Path) -> str:
    """What the pictures of a scene are."""
    if clip is None:
        return f"Pictures are rendered from the scene: {stages} does not hold its frames."
    return "Pictures are the frames that the scene was made of."


def _kept(stages: Path, scene: "Scene") -> "tuple[Clip | None, Geometry | None]":
    """What the run kept of clip and geometry; ``InputError`` where they are not those of the scene."""
    from dreamdrive.run import kept_clip, kept_geometry

    clip = kept_clip(stages, scene)
    return clip, None if clip is None else kept_geometry(stages, scene, clip)
