"""How far a box went from one scene to another, told by its Gaussians alone."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.evaluate import gaussians_of
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.similarity import Similarity
from dreamdrive.splat import render as splat, render_scene
from dreamdrive_bench.control.made import Made
from dreamdrive_bench.street.measure import to_scene

SHIFTS_M = np.arange(-1.5, 4.001, 0.25)
LOOKS = 6  # frames that a shift is found in
LIKE = 0.5  # squared error at the shift found over the greatest of all, from which on nothing is found


def shift(
    before: Made,
    after: Made,
    instance: int,
    wanted_m: np.ndarray,
    dynamic: bool,
    brought: Callable[[Made], Similarity],
) -> tuple[float | None, int]:
    """How far a box went along the wanted way, and in how many frames it was looked for.

    Its Gaussians of the scene before are moved by each of ``SHIFTS_M``, and the picture is compared with that
    of the scene after wherever they come to lie at any of them. What they leave uncovered is not known and
    not compared. A parabola goes through the best shift and its neighbours.

    Returns:
        The shift in metres, and the number of frames. None where the scene before does not show the box; or
        where no shift makes its own pixels much more alike than the worst one does, as when it is not there;
        or where the best one is the first or the last.
    """
    along = wanted_m / np.linalg.norm(wanted_m)
    far, own, looks = np.zeros(len(SHIFTS_M)), np.zeros((len(SHIFTS_M), 2)), 0
    frames = range(0, len(before.views), max(1, len(before.views) // LOOKS))
    for frame in frames:
        found = _agreement(before, after, frame, instance, along, dynamic, brought)
        if found is not None:
            far, own, looks = far + found[0], own + found[1], looks + 1
    best = int(far.argmin())
    apart = own[:, 0] / np.maximum(own[:, 1], 1)
    if not looks or apart[best] >= LIKE * apart.max():
        return None, looks
    return lowest(SHIFTS_M, far), looks


def _agreement(
    before: Made,
    after: Made,
    frame: int,
    instance: int,
    along: np.ndarray,
    dynamic: bool,
    brought: Callable[[Made], Similarity],
) -> tuple[np.ndarray, np.ndarray] | None:
    """By shift the squared error where the box may be; and that of its own pixels, with their number."""
    scene, truth = before.scene, before.truth
    found = gaussians_of(scene, before.views[frame], truth, frame, instance, moving=dynamic)
    if found is None:
        return None
    shown, own, _ = found
    here, there = brought(before), brought(after)
    camera = to_scene(_from_scene(after.views[frame], there), here)
    camera = before.views[frame].at(camera.world_from_camera)
    way = here.rotation.T @ along / here.scale
    pictures, covers = zip(
        *(_moved_picture(scene, shown, own, m * way, camera) for m in SHIFTS_M), strict=True
    )
    target = render_scene(
        after.scene, after.views[frame], float(after.scene.times_s[frame]), exposure=False
    ).colour.numpy()
    cover = np.stack(covers)
    at_rest = cover[int(np.abs(SHIFTS_M).argmin())]
    squared = np.square(np.stack(pictures) - target).mean(axis=-1)
    known = cover.any(axis=0) & (cover | ~at_rest)
    far = np.where(known, squared, 0).sum(axis=(1, 2))
    return far, np.stack([(squared * cover).sum(axis=(1, 2)), cover.sum(axis=(1, 2))], axis=1)


def _from_scene(camera: Camera, truth_from_scene: Similarity) -> Camera:
    """A camera of a scene in the world of the truth."""
    pose = np.eye(4)
    pose[:3, :3] = truth_from_scene.rotation @ camera.world_from_camera[:3, :3]
    pose[:3, 3] = truth_from_scene(camera.world_from_camera[:3, 3])
    return camera.at(pose)


@one_torch_thread()
@torch.no_grad()
def _moved_picture(
    scene: Scene, shown: Gaussians, own: np.ndarray, way_m: np.ndarray, camera: Camera
) -> tuple[np.ndarray, np.ndarray]:
    """A scene with some of its Gaussians moved (H, W, 3), and the pixels that they fill (H, W)."""
    chosen = torch.from_numpy(own)
    means = shown.means + chosen[:, None] * torch.from_numpy(way_m).to(shown.means.dtype)
    drawn = splat(replace(shown, means=means), camera, channels=chosen[:, None].to(means.dtype))
    colour = drawn.colour
    if scene.sky is not None:
        colour = colour + (1 - drawn.alpha)[..., None] * scene.sky.colour(camera)
    return colour.clamp(0, 1).numpy(), drawn.channels[..., 0].numpy() >= 0.5


def lowest(places: np.ndarray, errors: np.ndarray) -> float | None:
    """Where a parabola through the least error and its neighbours is lowest; None at either end."""
    best = int(errors.argmin())
    if best in (0, len(errors) - 1):
        return None
    a, b, c = errors[best - 1 : best + 2]
    step = float(places[1] - places[0])
    return float(places[best] + 0.5 * step * (a - c) / max(a - 2 * b + c, 1e-12))
