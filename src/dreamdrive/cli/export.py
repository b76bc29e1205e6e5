"""``dreamdrive export``: a scene in another program's format."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.console import Console
from tyro.conf import Positional, arg

from dreamdrive.choices import ExportKind
from dreamdrive.cli.progress import Bars
from dreamdrive.cli.scene import open_scene
from dreamdrive.errors import InputError
from dreamdrive.files.paths import inside

if TYPE_CHECKING:
    from dreamdrive.scene.clip import Clip
    from dreamdrive.scene.geometry import Geometry
    from dreamdrive.scene.scene import Scene

_OF_WORLD = "Pictures, poses and boxes are those of the drawn street."


def export(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    to: ExportKind,
    output: Annotated[Path, arg(aliases=["-o"], metavar="FILE|DIR")],
    force: bool = False,
) -> None:
    """Write a scene or a drawn street in a format that other programs read.

    Args:
        out: The folder that generate wrote; for nuscenes, ncore and mcap also one of world make.
        to: ply is what viewers of 3D Gaussians read; nuscenes a data set with pictures, labels and lidar;
            ncore the clip with its poses for NuRec, 3dgrut and gsplat; mcap the drive for Foxglove.
        output: For ply NAME.ply for everything at the first recorded time; else a folder for static.ply and,
            with everything at each recorded time, frames/NNNN.ply. For nuscenes and ncore a folder, for mcap
            NAME.mcap.
        force: Replace what is there already, if dreamdrive wrote it.
    """
    console = Console(highlight=False, markup=False, soft_wrap=True)
    if to == "nuscenes":
        _export_nuscenes(out, output, force)
        console.print(str(output))
    elif to == "ncore":
        said = _export_ncore(out, output, force)
        console.print(f"{output}\n{said}")
    elif to == "mcap":
        said = _export_mcap(out, output, force)
        console.print(f"{output}\n{said}")
    else:
        from dreamdrive.export import check_ply, export_ply, left_out_of_ply

        check_ply(output, force)
        scene = open_scene(out)
        export_ply(scene, output, replace=force)
        console.print(str(output))
        console.print(left_out_of_ply(scene, output))


def _export_nuscenes(out: Path, output: Path, force: bool) -> None:
    from dreamdrive.data.nuscenes import KIND
    from dreamdrive.export import export_scene, export_world
    from dreamdrive.files.output import check_free
    from dreamdrive.world import is_world, read_drives

    check_free(output, force, KIND)
    with Bars(Console()) as bars:
        said = partial(bars, "nuscenes")
        if is_world(out):
            export_world(read_drives(out), out.resolve().name, output, replace=force, progress=said)
        else:
            export_scene(open_scene(out), output, replace=force, progress=said)


def _export_ncore(out: Path, output: Path, force: bool) -> str:
    """Write it, and say what its pictures are."""
    from dreamdrive.export import NCORE_KIND, need_ncore, scene_to_ncore, world_to_ncore
    from dreamdrive.files.output import check_free
    from dreamdrive.world import is_world, read_drives

    need_ncore()
    check_free(output, force, NCORE_KIND)
    with Bars(Console()) as bars:
        said = partial(bars, "ncore")
        if is_world(out):
            world_to_ncore(read_drives(out), output, replace=force, progress=said)
            return _OF_WORLD
        scene, stages = open_scene(out), _stages(out)
        clip, geometry = _kept(stages, scene)
        scene_to_ncore(scene, output, clip=clip, geometry=geometry, replace=force, progress=said)
    return _of_pictures(clip, stages)


def _export_mcap(out: Path, output: Path, force: bool) -> str:
    """Write it, and say what its pictures are."""
    from dreamdrive.export import check_mcap, need_foxglove, scene_to_mcap, world_to_mcap
    from dreamdrive.world import is_world, read_drives

    need_foxglove()
    check_mcap(output, force)
    with Bars(Console()) as bars:
        said = partial(bars, "mcap")
        if is_world(out):
            world_to_mcap(read_drives(out), output, replace=force, progress=said)
            return _OF_WORLD
        scene, stages = open_scene(out), _stages(out)
        clip, _ = _kept(stages, scene)
        scene_to_mcap(scene, output, clip=clip, replace=force, progress=said)
    return _of_pictures(clip, stages)


def _stages(out: Path) -> Path:
    """Where the run of a scene keeps its results."""
    return (out.parent if (out / "scene.json").is_file() else out) / "stages"


def _of_pictures(clip: "Clip | None", stages: Path) -> str:
    """What the pictures of a scene are."""
    if clip is None:
        return f"Pictures are rendered from the scene: {stages} does not hold its frames."
    return "Pictures are the frames that the scene was made of."


def _kept(stages: Path, scene: "Scene") -> "tuple[Clip | None, Geometry | None]":
    """What the run kept of clip and geometry; ``InputError`` where they are not those of the scene."""
    import numpy as np

    from dreamdrive.run import check, codec
    from dreamdrive.scene.clip import Clip
    from dreamdrive.scene.geometry import Geometry

    prior, geometry = inside(stages, "prior"), inside(stages, "geometry")
    if not (prior / codec.JSON_NAME).is_file():
        return None, None
    try:
        clip = codec.read(prior, Clip)
        check.clip(clip)
        check.scene(clip, scene)
        if scene.provenance.source_index not in (None, tuple(clip.source_index.tolist())):
            raise ValueError("its frames are others")
        if not (geometry / codec.JSON_NAME).is_file():
            return clip, None
        found = codec.read(geometry, Geometry)
        check.geometry(clip, found)
        pairs = zip(found.cameras, scene.cameras, strict=True)
        if not all(np.allclose(a.world_from_camera, b.world_from_camera) for a, b in pairs):
            raise ValueError("its cameras are elsewhere")
    except ValueError as error:
        raise InputError(
            f"{stages} does not belong to the scene ({error}); run generate again, or let dreamdrive clean "
            "remove it: pictures are then rendered from the scene"
        ) from error
    return clip, found
