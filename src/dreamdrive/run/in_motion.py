"""How much of what a prior set in motion the decomposition has found again by itself."""

import numpy as np

from dreamdrive.evaluate import Retrieval, retrieval
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene


def found_again(clip: Clip, scene: Scene) -> Retrieval | None:
    """Pixels that dynamic Gaussians fill against those that were set in motion; None where nothing was."""
    if clip.set_in_motion is None or not clip.set_in_motion.any():
        return None
    views = zip(scene.cameras, scene.times_s.tolist(), strict=True)
    share = np.stack([render_scene(scene, camera, t_s).dynamic_share.numpy() for camera, t_s in views])
    return retrieval(clip.set_in_motion, share)
