"""Finding what the geometry stage of ``generate`` left."""

from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from dreamdrive.cli.scene import open_scene
from dreamdrive.errors import InputError
from dreamdrive.files.paths import inside

if TYPE_CHECKING:
    from dreamdrive.evaluate import Estimate
    from dreamdrive.scene.clip import Clip
    from dreamdrive.scene.geometry import Geometry

T = TypeVar("T")


def open_estimate(out: Path) -> "tuple[Estimate, tuple[str, ...]]":
    """Cameras and depth in an output folder of ``generate``, or the cameras of a scene folder elsewhere.

    A run that was stopped after its geometry is enough.

    Returns:
        The estimate, and what is missing from it, a sentence each.
    """
    from dreamdrive.evaluate import Estimate
    from dreamdrive.scene.clip import Clip
    from dreamdrive.scene.geometry import Geometry

    if out.name == "scene" and (out / "scene.json").is_file():
        out = out.parent
    geometry = _stage(inside(out, "stages/geometry"), Geometry)
    clip = None if (out / "scene").is_dir() else _stage(inside(out, "stages/prior"), Clip)
    if geometry is not None and clip is not None:
        _check_agreement(out, clip, geometry)
        source = clip.provenance.get("input")
        lens = clip.provenance.get("lens") is not None
        name = None if source is None else Path(str(source)).resolve().name
        made = Estimate.of(
            geometry, clip.times_s, clip.held_out, clip.source_index, source=name, undistorted=lens
        )
        return made, ()
    return _of_scene(out, geometry)


def _of_scene(out: Path, geometry: "Geometry | None") -> "tuple[Estimate, tuple[str, ...]]":
    """A finished scene, with the geometry it was made from where that was kept."""
    import numpy as np

    from dreamdrive.evaluate import Estimate

    scene = open_scene(out)
    about = scene.provenance
    index = np.array(about.source_index or range(len(scene.cameras)), dtype=np.int64)
    source, lens = about.input, about.lens is not None
    if geometry is None:
        missing = (
            f"{out / 'stages' / 'geometry'} is not there: depth, confidence and what fixed the scale cannot "
            "be measured; run generate again with the same options to have them."
        )
        made = Estimate(scene.cameras, scene.held_out, index, scene.times_s, source=source, undistorted=lens)
        return made, (missing,)
    same = len(geometry.cameras) == len(scene.cameras) and all(
        a.matrix.tolist() == b.matrix.tolist() and np.allclose(a.world_from_camera, b.world_from_camera)
        for a, b in zip(geometry.cameras, scene.cameras, strict=True)
    )
    if not same:
        raise InputError(
            f"{out} holds a scene and the geometry of another run: their cameras differ; finish that run, or "
            "run generate again with the options of the scene"
        )
    return Estimate.of(geometry, scene.times_s, scene.held_out, index, source=source, undistorted=lens), ()


def _check_agreement(out: Path, clip: "Clip", geometry: "Geometry") -> None:
    from dreamdrive.run import check

    try:
        check.clip(clip)
        check.geometry(clip, geometry)
    except ValueError as error:
        raise InputError(f"{out}: its stages do not belong together ({error}); run generate again") from error


def _stage(folder: Path, kind: type[T]) -> T | None:
    """What a stage left; None where there is nothing."""
    from dreamdrive.run import codec

    if not (folder / codec.JSON_NAME).is_file():
        return None
    try:
        return codec.read(folder, kind)
    except codec.DamagedError as error:
        raise InputError(f"{folder} is damaged ({error}); run generate again to compute it anew") from error
