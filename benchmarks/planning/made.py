"""Scenes of drawn streets as a planner has them: the frames up to now, and where the car was."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from common.drawn import drawn_clip
from common.twin import TWIN
from dreamdrive.choices import QualityName
from dreamdrive.decompose import DriftOptions
from dreamdrive.options import QUALITIES
from dreamdrive.pipeline import build_scene
from dreamdrive.prior.appearance import appearance
from dreamdrive.progress import Work
from dreamdrive.run import call
from dreamdrive.scene.clip import Known
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.stored import load_scene, save_scene
from dreamdrive.world import Drive

T = TypeVar("T")


def scene_of(record: Callable[[], Drive], quality: QualityName, folder: Path) -> Scene:
    """The scene of a drive's frames, made once; the car knows its own path, as any planner's does."""
    if not folder.is_dir():
        drive = record()
        known = Known(drive.trajectory.world_from_camera, intrinsics=True, metric=True)
        clip = drawn_clip(drive, known=known)
        clip = clip.with_features(appearance=appearance(clip.frames, clip.valid))
        kept: dict[str, Any] = {}

        def run(name: str, options: object, compute: Callable[[Work], T], **more: Any) -> T:
            value = call(name, options, compute, **more)
            kept[name] = value
            return value

        # In a street that drifts nothing has a place in which it could be hit.
        options = replace(QUALITIES[quality], knowledge=TWIN, drift=DriftOptions(allowed=False))
        scene = build_scene(clip, options, run=run)
        folder.parent.mkdir(parents=True, exist_ok=True)
        save_scene(_on_its_road(scene, kept["geometry"]), folder)
    return load_scene(folder)


def _on_its_road(scene: Scene, geometry: Geometry) -> Scene:
    assert geometry.ground is not None
    about = replace(
        scene.provenance,
        up=tuple(geometry.ground.normal_world.tolist()),
        camera_height_m=geometry.ground.offset_m,
    )
    return replace(scene, provenance=about)
