"""Recall of what a prior set in motion by the decomposition."""

from dataclasses import dataclass

import numpy as np

from dreamdrive.metrics.retrieval import Retrieval, retrieval
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene


@dataclass(frozen=True)
class FoundTraffic:
    """What a prior set in motion, and what the scene holds of it.

    Attributes:
        things: How many things it set in motion.
        found: How many that move the scene has.
        recall: Share of its pixels that are found to move; None where nothing was set in motion.
        precision: Share of the pixels found to move that it set in motion; None where none are.
    """

    things: int
    found: int
    recall: float | None
    precision: float | None


def found_again(clip: Clip, scene: Scene) -> Retrieval | None:
    """Pixels that dynamic Gaussians fill against those that were set in motion; None where nothing was."""
    if clip.set_in_motion is None or not clip.set_in_motion.any():
        return None
    views = zip(scene.cameras, scene.times_s.tolist(), strict=True)
    share = np.stack([render_scene(scene, camera, t_s).dynamic_share.numpy() for camera, t_s in views])
    return retrieval(clip.set_in_motion, share)


def traffic_of(clip: Clip, scene: Scene, again: Retrieval | None) -> FoundTraffic | None:
    """The same in numbers of things; None where the frames are of no prior that decides what moves."""
    things = clip.provenance.get("set_in_motion")
    if things is None:
        return None
    shares = (None, None) if again is None else (again.recall, again.precision)
    return FoundTraffic(int(things), len(scene.actors), *shares)
