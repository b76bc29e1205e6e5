"""Checks that what stages left on disk belongs together.

All raise ``ValueError`` where it does not: the stage is then computed again.
"""

import numpy as np
from torch import Tensor

from dreamdrive.decompose import Grouping
from dreamdrive.fit import StaticFit
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.look import Look


def clip(clip: object) -> None:
    """Frames of the cameras' size, in the order of time."""
    if not isinstance(clip, Clip) or not len(clip):
        raise ValueError("it holds no clip")
    if any((camera.width_px, camera.height_px) != clip.size for camera in clip.rig):
        raise ValueError("the cameras are not of the frames' size")
    for camera in range(len(clip.rig)):
        if (np.diff(clip.times_s[clip.of_camera(camera)]) <= 0).any():
            raise ValueError("the times run back")


def looks(clip: Clip, looks: object) -> None:
    """A look for each camera, with all its frames; none where nobody looked."""
    if not isinstance(looks, tuple) or not all(isinstance(look, Look) for look in looks):
        raise ValueError("it holds no looks")
    width, height = clip.size
    wanted = [(len(clip.of_camera(camera)), height, width) for camera in range(len(clip.rig))]
    if looks and [look.depth.shape for look in looks] != wanted:
        raise ValueError(f"its looks are not of the clip's frames, {wanted}")


def geometry(clip: Clip, geometry: object) -> None:
    """A camera and a depth for each frame."""
    if not isinstance(geometry, Geometry) or len(geometry.cameras) != len(clip):
        raise ValueError(f"it holds no geometry of {len(clip)} frames")
    if geometry.depth_m.shape != clip.frames.shape[:3] or len(geometry.fixed_regions) != len(clip.rig):
        raise ValueError(f"its depth is {geometry.depth_m.shape}, the frames are {clip.frames.shape[:3]}")
    if any((camera.width_px, camera.height_px) != clip.size for camera in geometry.cameras):
        raise ValueError("its cameras are not of the frames' size")
    if (
        not 0
        <= int(geometry.fixed_regions.min())
        <= int(geometry.fixed_regions.max())
        <= len(geometry.region_names)
    ):
        raise ValueError("it knows regions without a name")


def seeds(clip: Clip, seeds: object) -> None:
    """Gaussians of frames that there are."""
    if not isinstance(seeds, Gaussians) or not len(seeds):
        raise ValueError("it holds no Gaussians")
    if not 0 <= int(seeds.source_frame.min()) <= int(seeds.source_frame.max()) < len(clip):
        raise ValueError(f"its Gaussians come from frames beyond the {len(clip)} of the clip")


def static(seeds: Gaussians, static: object) -> None:
    """A fitted Gaussian for each seed."""
    if not isinstance(static, StaticFit) or len(static.gaussians) != len(seeds):
        raise ValueError(f"it holds no fit of {len(seeds)} Gaussians")


def scores(seeds: Gaussians, scores: object) -> None:
    """A score in [0, 1] for each seed."""
    if not isinstance(scores, Tensor) or tuple(scores.shape) != (len(seeds),):
        raise ValueError(f"it holds no scores of {len(seeds)} Gaussians")
    if not 0 <= float(scores.min()) <= float(scores.max()) <= 1:
        raise ValueError("its scores are not between 0 and 1")


def grouping(seeds: Gaussians, grouping: object) -> None:
    """A label for each seed."""
    if not isinstance(grouping, Grouping) or len(grouping.dynamic) != len(seeds):
        raise ValueError(f"it holds no labels of {len(seeds)} Gaussians")
    if not -1 <= int(grouping.cluster.min()) <= int(grouping.cluster.max()) < len(seeds):
        raise ValueError("its clusters have impossible numbers")


def scene(clip: Clip, scene: Scene) -> None:
    """A view for each frame."""
    if len(scene.cameras) != len(clip) or scene.times_s.tolist() != clip.times_s.tolist():
        raise ValueError(f"it holds no scene of the {len(clip)} frames")
