"""Scores of a scene's decomposition against the truth of a simulated world."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float

from dreamdrive.evaluate.actor_boxes import BoxError, box_error
from dreamdrive.evaluate.actor_places import ActorError, actor_error
from dreamdrive.evaluate.truth.drawn import Truth, views_of
from dreamdrive.metrics.retrieval import Retrieval, retrieval
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.similarity import fit_similarity
from dreamdrive.splat import render_scene

EDGE_SHARE = 1 / 64
"""Width of the rim around moving things, over that of the picture, which counts as no static surface."""
MOVED_M = 0.1
"""Mean distance from which on something that is shown counts as moved."""
BEHIND = 1.1
"""Depth over the true one from which on a Gaussian lies behind the surface that a pixel shows."""


@dataclass(frozen=True)
class FakeMotion:
    """How much the static street of a scene moves.

    Attributes:
        mean_m: Mean distance between where Gaussians are when they show truly static surface and where they
            are at the other times; metres of the truth.
        moved_share: Share of the truly static surface that is shown by Gaussians for which it is over 0.1 m.
    """

    mean_m: float
    moved_share: float


@dataclass(frozen=True)
class Decomposition:
    """Figures of one scene; see docs/reference/evaluate_decomposition.md for what they tell.

    Attributes:
        frames: Number of frames.
        width_px: Width of the frames that were compared.
        scale: Metres of the truth for a metre of the scene, as the cameras have it.
        path_rms_m: Root mean square distance of the cameras that is left then.
        mask: Pixels of moving things, all frames together; the score of a pixel is the share of it that
            dynamic Gaussians fill.
        labels: Gaussians of moving things; see ``true_labels``.
        fake: How much the static street moves; None where the truth holds no static surface.
        actors: Where moving road users are, over time.
        boxes: Boxes of the actors; None where the truth holds none.
    """

    frames: int
    width_px: int
    scale: float
    path_rms_m: float
    mask: Retrieval
    labels: Retrieval
    fake: FakeMotion | None
    actors: ActorError
    boxes: BoxError | None


def evaluate_decomposition(scene: Scene, truth: Truth) -> Decomposition:
    """Measure how well a scene tells static from moving, against the truth of the same frames, one by one.

    The scene may be of any representation, size and metric scale: the similarity that brings its cameras onto
    the true ones is taken out.

    Raises:
        InputError: The scene has another number of frames, or frames of another shape.
    """
    views = views_of(scene, truth)
    similarity = fit_similarity(views, truth.cameras)
    seen = _look(scene, views)
    share = np.stack([s.dynamic for s in seen])
    moving, judged = true_labels(scene, views, truth, similarity.scale)
    labels = np.repeat([0.0, 1.0], [len(scene.static), len(scene.dynamic)])
    found, asked = (np.stack([c.world_from_camera[:3, 3] for c in cs]) for cs in (views, truth.cameras))
    left_m = np.linalg.norm(similarity(found) - asked, axis=1)
    return Decomposition(
        frames=len(views),
        width_px=truth.size[0],
        scale=similarity.scale,
        path_rms_m=float(np.sqrt(np.square(left_m).mean())),
        mask=retrieval(truth.moving, share),
        labels=retrieval(moving[judged], labels[judged]),
        fake=_fake_motion(seen, _static_surface(truth), similarity.scale),
        actors=actor_error(scene, views, truth, similarity),
        boxes=box_error(scene, views, truth, similarity),
    )


@torch.no_grad()
def places(scene: Scene, t_s: float) -> Float[np.ndarray, "n 3"]:
    """Centres of all Gaussians at a time, the static ones first; also of those whose life span is over."""
    moved = scene.dynamic.without_features()
    if scene.deformation is not None:
        moved = scene.deformation.apply_at(moved, t_s)
    return torch.cat([scene.static_at(t_s).means, moved.means]).numpy().astype(np.float64)


def true_labels(
    scene: Scene, views: Sequence[Camera], truth: Truth, scale: float
) -> tuple[Bool[np.ndarray, " n"], Bool[np.ndarray, " n"]]:
    """Whether each Gaussian, the static ones first, stands for something that moves; whether it was judged.

    A Gaussian is judged in the frame it was seeded from, where it is at that frame's time. It is moving if
    its centre falls on a pixel of a moving road user and does not lie behind it, by more than a tenth of the
    true depth. What lies nearer counts: the pixel shows nothing nearer than the road user, so that this is
    the road user itself at a wrong depth. One that has left the picture of its frame, or that names none, is
    judged in the frame where its depth is nearest to the true one. One that is in no picture, or before the
    sky only, is not judged.

    The views are the scene's cameras at the size of the truth; ``scale`` is metres of the truth for one of
    the scene.
    """
    source = torch.cat([scene.static.source_frame, scene.dynamic.source_frame]).numpy()
    moving = np.zeros(len(source), dtype=bool)
    # Logarithmic distance from the true depth in the frame that has judged so far; -1 is the last word.
    distance = np.full(len(source), np.inf)
    for frame, camera in enumerate(views):
        projected = camera.project(places(scene, float(scene.times_s[frame])))
        column, row, z = projected.T
        seen = np.flatnonzero(camera.shows(projected))
        pixel = frame, row[seen].astype(int), column[seen].astype(int)
        solid = truth.depth_m[pixel] > 0
        seen, pixel = seen[solid], (frame, pixel[1][solid], pixel[2][solid])
        ratio = scale * z[seen] / truth.depth_m[pixel]
        here = np.where(source[seen] == frame, -1.0, np.abs(np.log(ratio)))
        nearer = here < distance[seen]
        rows = seen[nearer]
        distance[rows] = here[nearer]
        moving[rows] = (truth.moving[pixel] & (ratio < BEHIND))[nearer]
    return moving, np.isfinite(distance)


@dataclass(frozen=True)
class _Seen:
    """One frame of a scene: shares of a pixel that dynamic Gaussians fill and that any cover, and what moves.

    ``moves`` is the distance to the other times, composited, in metres of the scene.
    """

    dynamic: Float[np.ndarray, "h w"]
    alpha: Float[np.ndarray, "h w"]
    moves: Float[np.ndarray, "h w"]


def _look(scene: Scene, views: Sequence[Camera]) -> list[_Seen]:
    """Every frame, with the ways of the dynamic Gaussians as a further channel."""
    times_s = scene.times_s.tolist()
    centres = np.stack([places(scene, t_s)[len(scene.static) :] for t_s in times_s])
    alive = _alive(scene)
    seen: list[_Seen] = []
    for frame, (camera, t_s) in enumerate(zip(views, times_s, strict=True)):
        living = scene.dynamic.alive_at(t_s).numpy()
        moves = _moves(centres[:, living], alive[:, living], frame)
        channel = torch.cat([torch.zeros(len(scene.static)), torch.from_numpy(moves.astype(np.float32))])
        view = render_scene(scene, camera, t_s, channels=channel[:, None])
        seen.append(_Seen(view.dynamic_share.numpy(), view.alpha.numpy(), view.channels[..., 0].numpy()))
    return seen


def _alive(scene: Scene) -> Float[np.ndarray, "f n"]:
    """Share of its opacity that each dynamic Gaussian has at each frame's time."""
    times_s = torch.from_numpy(scene.times_s)[:, None]
    if scene.dynamic.lifespan is None:
        return np.ones((len(times_s), len(scene.dynamic)))
    centre_s, deviation_s = scene.dynamic.lifespan.double().unbind(-1)
    return torch.exp(-0.5 * ((times_s - centre_s) / deviation_s.clamp(min=1e-6)) ** 2).numpy()


def _moves(
    centres: Float[np.ndarray, "f n 3"], alive: Float[np.ndarray, "f n"], frame: int
) -> Float[np.ndarray, " n"]:
    """Mean distance (N,) from the place in a frame to those in others, as far as it is alive there."""
    others = np.arange(len(centres)) != frame
    distance = np.linalg.norm(centres[others] - centres[frame], axis=2)
    weight = alive[others]
    return (weight * distance).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-9)


def _static_surface(truth: Truth) -> Bool[np.ndarray, "f h w"]:
    """Pixels of what truly stands, less a rim of those into which splats of moving things reach."""
    reach = max(2, round(EDGE_SHARE * truth.size[0]))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    near = np.stack([cv2.dilate(mask.astype(np.uint8), disc) > 0 for mask in truth.moving])
    return (truth.depth_m > 0) & ~near


def _fake_motion(
    seen: Sequence[_Seen], surface: Bool[np.ndarray, "f h w"], scale: float
) -> FakeMotion | None:
    """Means over the pixels of static surface, each weighing by what covers it."""
    alpha = np.stack([s.alpha for s in seen])[surface].astype(np.float64)
    moves = np.stack([s.moves for s in seen])[surface].astype(np.float64)
    if not alpha.sum() > 0:
        return None
    moved = moves * scale > MOVED_M * np.maximum(alpha, 1e-6)
    return FakeMotion(float(scale * moves.sum() / alpha.sum()), float(alpha[moved].sum() / alpha.sum()))
