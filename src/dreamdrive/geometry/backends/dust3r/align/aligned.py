"""The result of an alignment, with what tells whether to believe it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.geometry.backends.dust3r.align.focal import FocalVotes
from dreamdrive.geometry.backends.dust3r.align.graph import Graph
from dreamdrive.geometry.backends.dust3r.align.normal import ImageSamples
from dreamdrive.geometry.backends.dust3r.align.state import State
from dreamdrive.geometry.backends.dust3r.align.turned_focal import TurnedFocal
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps
from dreamdrive.geometry.cameras import unit_in
from dreamdrive.scene.similarity import Similarity

_NETWORK_FOCAL = 0.05  # relative; how far all pairs may be off together, however well they agree
_AGREED_FOCAL = 0.03  # standard error of the median of the pairs up to which they agree
_SURE_STEP = 0.5  # of the way between paired images, by which a pair's own camera may be off


@dataclass(frozen=True)
class Aligned:
    """Cameras and depth of all images in one world.

    Without known poses the world is the camera of image 0 and the unit is free. Where nothing but the network
    speaks for the focal lengths, their error is 0.05 or more. The spread of pairs is the median distance
    between where a pair has its first camera and where that ended, in units of the median distance between
    paired cameras.
    """

    world_from_camera: Float[np.ndarray, "n 4 4"]
    focals_px: Float[np.ndarray, " n"]
    depth: tuple[Float[np.ndarray, "_ _"], ...]  # along z, positive, in the unit of the poses
    pairs: tuple[Similarity, ...]  # from each pair's first camera, in the pair's own unit, to the world
    confidence: tuple[Float[np.ndarray, "_ _"], ...]  # the greatest that an edge gave; 1 is masked out
    loss: float  # of the objective, over all pixels, in the unit in which the pairs' scales average 0.5
    losses: tuple[float, ...]  # over the solver's samples, before each of its last steps and at the end
    focal_error: float  # standard deviation of the focal lengths, relative; 0 where they are known
    network_focal_px: float  # median over edges of what pointmaps speak for
    focal_spread: float  # robust standard deviation of that over edges, relative
    pair_spread: float
    residual: Float[np.ndarray, " e"]  # median relative miss of each pair's points
    masked_share: Float[np.ndarray, " n"]  # of the pixels, that no edge weighs
    focal_observed: bool  # the focal lengths are known, or the turns of the camera show them
    focal_agreed: bool  # the pointmaps agree on one
    path_observed: bool  # the cameras move by more than pairs disagree; else the path is not to be believed


@dataclass(frozen=True)
class Solution:
    """What the solver leaves behind: depth along z and loss over all pixels, its losses over the samples."""

    state: State
    depth: tuple[Float[np.ndarray, "_ _"], ...]
    loss: float
    samples: Sequence[ImageSamples]
    losses: tuple[float, ...]


def report(
    maps: PairMaps,
    graph: Graph,
    found: Solution,
    votes: FocalVotes,
    turned: TurnedFocal | None,
    *,
    focal_known: bool,
    known_poses: Float[np.ndarray, "n 4 4"] | None,
) -> Aligned:
    """Bring the solution to the frame of image 0, or to that of the known poses, and measure it."""
    frame = _frame(found, known_poses)
    poses = found.state.world_from_camera
    poses[:, :3, :3], poses[:, :3, 3] = frame.rotation @ found.state.rotation, frame(found.state.centre)
    if known_poses is None:
        poses[0] = np.eye(4)
    confidence = [
        np.maximum.reduce([maps.confidence[h.edge][h.side] for h in halves]) for halves in graph.halves
    ]
    pair_spread = _pair_spread(maps, found.state)
    pairs = zip(found.state.edge_scale, found.state.edge_rotation, found.state.edge_centre, strict=True)
    error = votes.spread / float(np.sqrt(len(graph)))
    shown = turned.spread if turned is not None and turned.observed else None
    return Aligned(
        world_from_camera=poses if known_poses is None else known_poses.astype(np.float64),
        focals_px=found.state.focal_px,
        depth=tuple(depth * np.float32(frame.scale) for depth in found.depth),
        pairs=tuple(Similarity(frame.scale * float(s), frame.rotation @ r, frame(t)) for s, r, t in pairs),
        confidence=tuple(confidence),
        loss=found.loss,
        losses=found.losses,
        focal_error=0.0 if focal_known else max(error, _NETWORK_FOCAL) if shown is None else shown,
        network_focal_px=votes.shared_px,
        focal_spread=votes.spread,
        pair_spread=pair_spread,
        residual=_residuals(found, len(maps.edges)),
        masked_share=np.array([float((trust <= 1).mean()) for trust in confidence]),
        focal_observed=focal_known or shown is not None,
        focal_agreed=error <= _AGREED_FOCAL,
        path_observed=known_poses is not None or pair_spread <= _SURE_STEP,
    )


def _frame(found: Solution, known: Float[np.ndarray, "n 4 4"] | None) -> Similarity:
    """From the solver's world to that of the result."""
    state = found.state
    if known is None:
        turn = state.rotation[0].T
        return Similarity(1.0, turn, -turn @ state.centre[0])
    middle = float(np.median([np.median(depth) for depth in found.depth]))
    return Similarity(unit_in(known, state.world_from_camera, middle), np.eye(3), np.zeros(3))


def _pair_spread(maps: PairMaps, state: State) -> float:
    first, second = state.centre[maps.edges[:, 0]], state.centre[maps.edges[:, 1]]
    apart = float(np.median(np.linalg.norm(second - first, axis=1)))
    missed = float(np.median(np.linalg.norm(state.edge_centre - first, axis=1)))
    return missed / apart if apart > 0 else float("inf")


def _residuals(found: Solution, edges: int) -> Float[np.ndarray, " e"]:
    parts: list[list[np.ndarray]] = [[] for _ in range(edges)]
    for samples in found.samples:
        here = found.depth[samples.image].ravel()[samples.index].astype(np.float64)
        misses = samples.misses(found.state)
        along = misses.length.numpy() * (here - misses.foot.numpy())
        relative = np.sqrt(along**2 + misses.across2.numpy()) / here
        for k, edge in enumerate(samples.edges):
            parts[edge].append(relative[k][samples.weight[k].numpy() > 0])
    return np.array([np.median(np.concatenate(part)) for part in parts])
