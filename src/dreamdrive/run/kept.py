"""What a run keeps of a scene under ``stages``: its frames, its geometry, the scores, the static fit."""

from pathlib import Path

import numpy as np
import torch

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json
from dreamdrive.files.paths import inside
from dreamdrive.fit import StaticFit
from dreamdrive.run import codec
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.show import Scored
from dreamdrive.stored import check


def stages_of(out: Path) -> Path:
    """Where the run of a scene keeps its results; ``out`` is its folder, or the scene's own in it."""
    return (out.parent if (out / "scene.json").is_file() else out) / "stages"


def is_kept(stages: Path, name: str) -> bool:
    """Whether the result of a stage is there, as far as can be told without reading it."""
    return (inside(stages, name) / codec.JSON_NAME).is_file()


def kept_clip(stages: Path, scene: Scene) -> Clip | None:
    """The frames that a scene was made of; None where they are gone.

    Raises:
        InputError: There are others.
    """
    if not is_kept(stages, "prior"):
        return None
    try:
        clip = codec.read(inside(stages, "prior"), Clip)
        check.clip(clip)
        check.scene(clip, scene)
        if scene.provenance.source_index not in (None, tuple(clip.source_index.tolist())):
            raise ValueError("its frames are others")
    except ValueError as error:
        raise _foreign(stages, error) from error
    return clip


def kept_geometry(stages: Path, scene: Scene, clip: Clip) -> Geometry | None:
    """The geometry that a scene of a clip was made with; None where it is gone.

    Raises:
        InputError: There is another.
    """
    if not is_kept(stages, "geometry"):
        return None
    try:
        found = codec.read(inside(stages, "geometry"), Geometry)
        check.geometry(clip, found)
        pairs = zip(found.cameras, scene.cameras, strict=True)
        if not all(np.allclose(a.world_from_camera, b.world_from_camera) for a, b in pairs):
            raise ValueError("its cameras are elsewhere")
    except ValueError as error:
        raise _foreign(stages, error) from error
    return found


def kept_scores(stages: Path) -> Scored | None:
    """The static fit with its dynamic scores; None where a run has none or has freed them.

    Raises:
        InputError: They cannot be used.
    """
    if not (is_kept(stages, "static") and is_kept(stages, "score")):
        return None
    try:
        fitted = codec.read(inside(stages, "static"), StaticFit).gaussians
        scores = codec.read(inside(stages, "score"), torch.Tensor)
        check.scores(fitted, scores)
        request = read_json(stages / "request.json", follow=False)
        threshold = float(request["request"]["options"]["group"]["threshold"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{stages} holds scores that cannot be used ({error})") from error
    return Scored(fitted, scores, threshold)


def kept_static(stages: Path) -> Scene:
    """What the static fit of an unfinished run has: everything as if nothing moved.

    Raises:
        InputError: It is not there, or does not fit the results before it.
    """
    clip = codec.read(inside(stages, "prior"), Clip)
    geometry = codec.read(inside(stages, "geometry"), Geometry)
    fitted = codec.read(inside(stages, "static"), StaticFit)
    try:
        check.clip(clip)
        check.geometry(clip, geometry)
    except ValueError as error:
        raise InputError(f"{stages} holds results of several runs ({error})") from error
    none = fitted.gaussians.select(torch.zeros(0, dtype=torch.int64))
    ground = geometry.ground
    about = Provenance(
        up=None if ground is None else tuple(ground.normal_world.tolist()),
        camera_height_m=None if ground is None else ground.offset_m,
    )
    return Scene(
        fitted.gaussians,
        none,
        None,
        (),
        fitted.sky,
        fitted.exposure,
        geometry.cameras,
        clip.times_s,
        clip.held_out,
        about,
        clip.camera if len(clip.rig) > 1 else None,
    )


def _foreign(stages: Path, error: ValueError) -> InputError:
    return InputError(
        f"{stages} does not belong to the scene ({error}); run generate again, or let dreamdrive clean "
        "remove it: pictures are then rendered from the scene"
    )
