"""Scenes of drawn streets as a planner has them: the frames up to now, and where the car was."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from dreamdrive.build import build_scene
from dreamdrive.decompose import PerFrameOptions
from dreamdrive.names import QualityName
from dreamdrive.options import QUALITIES
from dreamdrive.prior import appearance
from dreamdrive.scene.clip import Known
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive.stored import load_scene, save_scene
from dreamdrive_bench.common.drawn import drawn_clip
from dreamdrive_bench.common.recorder import Recorder
from dreamdrive_bench.common.twin import TWIN


def scene_of(record: Callable[[], DriveTruth], quality: QualityName, folder: Path) -> Scene:
    """The scene of a drive's frames, made once; the car knows its own path, as any planner's does."""
    if not folder.is_dir():
        drive = record()
        known = Known(drive.trajectory.world_from_camera, intrinsics=True, metric=True)
        clip = drawn_clip(drive, known=known)
        clip = clip.with_features(appearance=appearance(clip.frames, clip.valid))
        run = Recorder()
        # In a street that drifts nothing has a place in which it could be hit.
        options = replace(QUALITIES[quality], knowledge=TWIN, drift=PerFrameOptions(allowed=False))
        scene = build_scene(clip, options, run=run).scene
        folder.parent.mkdir(parents=True, exist_ok=True)
        save_scene(_on_its_road(scene, run.results["geometry"]), folder)
    return load_scene(folder)


def _on_its_road(scene: Scene, geometry: Geometry) -> Scene:
    assert geometry.ground is not None
    about = replace(
        scene.provenance,
        up=tuple(geometry.ground.normal_world.tolist()),
        camera_height_m=geometry.ground.offset_m,
    )
    return replace(scene, provenance=about)
