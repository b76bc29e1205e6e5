"""What every export offers, and those of dreamdrive; what writes them is loaded when one is taken."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from dreamdrive.files.kinds import (
    COLMAP_KIND,
    DEPTH_KIND,
    FLOW_KIND,
    GLB_KIND,
    NCORE_KIND,
    NERFSTUDIO_KIND,
    NUSCENES_KIND,
    PLY_KIND,
    SOG_KIND,
    SPZ_KIND,
)
from dreamdrive.files.output import check_ending, check_free, check_new_file
from dreamdrive.registry import loaded

if TYPE_CHECKING:
    from dreamdrive.scene.scene import Scene

Place = str | Callable[..., Any]
"""A function, or where it is as ``module:name``, so that it is loaded when it is called."""


@dataclass(frozen=True, kw_only=True)
class Export:
    """A format of other programs, by its name for ``--to``.

    Attributes:
        name: For the command line.
        about: What it is, for people.
        scene: Writes a scene; of it, a path, and by name ``replace``, ``progress`` and what is in ``takes``.
        world: Likewise of the drives of a drawn street; None where that is not written.
        takes: ``clip`` and ``geometry``, of which a scene was made; ``name``, that of a drawn street; and
            what a user may ask for: ``times``, moments, which come as ``times_s``; ``trajectory``, a new
            drive, whose views the scene then has, with no clip; ``blur``, a function that changes each
            picture before it is written; ``labels``, those of the drive that a scene was made of. These come
            only where they are asked for.
        ending: Of the file that it is, or several; None of a folder.
        folder: The kind of folder that it is, see ``files.kinds``; None of a file. Of both, the path decides.
        need: Raises ``InputError`` where a package is missing.
        left_out: Says what of a scene has no place in it, of the scene and the path.
    """

    name: str
    about: str
    scene: Place
    world: Place | None = None
    takes: frozenset[str] = frozenset()
    ending: str | tuple[str, ...] | None = None
    folder: str | None = None
    need: Place | None = None
    left_out: Place | None = None

    def check(self, path: Path, replace: bool) -> None:
        """Fail before anything is loaded where the path cannot be written, or a package is missing."""
        endings = (self.ending,) if isinstance(self.ending, str) else self.ending or ()
        if endings and self.folder is None:
            check_ending(path, *endings)
        if self.folder is None or path.suffix.lower() in endings:
            check_new_file(path, replace)
        else:
            check_free(path, replace, self.folder)
        if self.need is not None:
            function(self.need)()


def function(place: Place) -> Callable[..., Any]:
    """The function at a place."""
    return cast("Callable[..., Any]", loaded(place)) if isinstance(place, str) else place


def _always(sentence: str) -> Callable[["Scene", Path], str]:
    """What is left out of every scene."""
    return lambda scene, path: sentence


_DRIVE = "the drive, no Gaussians: boxes are of actors of which kind and size are known"
_CAMERAS = "frames, pinholes and centres of what stands: no Gaussians, no sky, nothing of what moves"
PLY = Export(
    name="ply",
    about="what viewers of 3D Gaussians read",
    scene="dreamdrive.export.ply:export_ply",
    takes=frozenset({"times"}),
    ending=".ply",
    folder=PLY_KIND,
    left_out="dreamdrive.export.ply:left_out_of_ply",
)
NUSCENES = Export(
    name="nuscenes",
    about="a data set in the format of nuScenes, with pictures, labels and lidar",
    scene="dreamdrive.export.nuscenes.nuscenes:export_scene",
    world="dreamdrive.export.nuscenes.nuscenes:world_to_nuscenes",
    takes=frozenset({"name", "trajectory", "blur", "labels"}),
    folder=NUSCENES_KIND,
    left_out=_always(f"nuScenes holds {_DRIVE}; a map comes with --labels."),
)
NCORE = Export(
    name="ncore",
    about="the clip with its poses for NuRec, 3dgrut and gsplat",
    scene="dreamdrive.export.ncore.ncore:scene_to_ncore",
    world="dreamdrive.export.ncore.ncore:world_to_ncore",
    takes=frozenset({"clip", "geometry", "trajectory", "blur"}),
    folder=NCORE_KIND,
    need="dreamdrive.export.ncore.words:need_ncore",
    left_out=_always(f"NCore holds {_DRIVE}."),
)
MCAP = Export(
    name="mcap",
    about="the drive for Foxglove",
    scene="dreamdrive.export.mcap.mcap:scene_to_mcap",
    world="dreamdrive.export.mcap.mcap:world_to_mcap",
    takes=frozenset({"clip", "trajectory", "blur"}),
    ending=".mcap",
    need="dreamdrive.export.mcap.file:need_foxglove",
    left_out=_always(f"MCAP holds {_DRIVE}."),
)
COLMAP = Export(
    name="colmap",
    about="frames, cameras and points as a COLMAP model",
    scene="dreamdrive.export.cameras.colmap:scene_to_colmap",
    takes=frozenset({"clip", "trajectory", "blur"}),
    folder=COLMAP_KIND,
    left_out=_always(f"COLMAP holds {_CAMERAS}."),
)
NERFSTUDIO = Export(
    name="nerfstudio",
    about="frames, cameras and points with transforms.json",
    scene="dreamdrive.export.cameras.nerfstudio:scene_to_nerfstudio",
    takes=frozenset({"clip", "trajectory", "blur"}),
    folder=NERFSTUDIO_KIND,
    left_out=_always(f"transforms.json holds {_CAMERAS}."),
)
TUM = Export(
    name="tum",
    about="the path of the first camera, a pose a line",
    scene="dreamdrive.export.cameras.tum:scene_to_tum",
    takes=frozenset({"trajectory"}),
    ending=".txt",
    left_out=_always("TUM holds the path of the first camera, no calibration."),
)
DEPTH = Export(
    name="depth",
    about="metres of every pixel in 16 bits, as KITTI has them, with pictures and cameras",
    scene="dreamdrive.export.surfaces.depth:scene_to_depth",
    takes=frozenset({"clip", "trajectory", "blur"}),
    folder=DEPTH_KIND,
    left_out="dreamdrive.export.surfaces.depth:left_out_of_depth",
)
FLOW = Export(
    name="flow",
    about="optical flow from frame to frame, as KITTI has it",
    scene="dreamdrive.export.surfaces.flow:scene_to_flow",
    takes=frozenset({"clip", "trajectory", "blur"}),
    folder=FLOW_KIND,
    left_out="dreamdrive.export.surfaces.flow:left_out_of_flow",
)
MESH = Export(
    name="mesh",
    about="road and standing surfaces as coloured triangles, PLY or GLB",
    scene="dreamdrive.export.surfaces.mesh:scene_to_mesh",
    ending=(".ply", ".glb"),
    need="dreamdrive.export.surfaces.mesh:need_scikit_image",
    left_out="dreamdrive.export.surfaces.mesh:left_out_of_mesh",
)
HTML = Export(
    name="html",
    about="one page that plays the scene in a browser",
    scene="dreamdrive.export.page.page:scene_to_page",
    takes=frozenset({"times"}),
    ending=".html",
    left_out="dreamdrive.export.page.page:left_out_of_page",
)
SPZ = Export(
    name="spz",
    about="Gaussians in a fifth of the size of PLY",
    scene="dreamdrive.export.splats.spz:scene_to_spz",
    takes=frozenset({"times"}),
    ending=".spz",
    folder=SPZ_KIND,
    need="dreamdrive.data.splats.spz:need_zstandard",
    left_out="dreamdrive.export.splats.spz:left_out_of_spz",
)
GLB = Export(
    name="glb",
    about="Gaussians as glTF, the standard of Khronos",
    scene="dreamdrive.export.splats.glb:scene_to_glb",
    takes=frozenset({"times"}),
    ending=".glb",
    folder=GLB_KIND,
    left_out="dreamdrive.export.splats.glb:left_out_of_glb",
)
USD = Export(
    name="usd",
    about="Gaussians over time as OpenUSD, with the recorded camera",
    scene="dreamdrive.export.splats.usd:scene_to_usd",
    takes=frozenset({"times"}),
    ending=".usdc",
    need="dreamdrive.export.splats.usd:need_usd",
    left_out="dreamdrive.export.splats.usd:left_out_of_usd",
)
FOURDGS = Export(
    name="4dgs",
    about="Gaussians over time in the open format of that name",
    scene="dreamdrive.export.splats.fourdgs:scene_to_4dgs",
    takes=frozenset({"times"}),
    ending=".4dgs",
    need="dreamdrive.export.splats.fourdgs:need_fourdgs",
    left_out="dreamdrive.export.splats.fourdgs:left_out_of_4dgs",
)
SOG = Export(
    name="sog",
    about="Gaussians as SuperSplat's format for the web",
    scene="dreamdrive.export.splats.sog:scene_to_sog",
    takes=frozenset({"times"}),
    ending=".sog",
    folder=SOG_KIND,
    left_out="dreamdrive.export.splats.sog:left_out_of_sog",
)
