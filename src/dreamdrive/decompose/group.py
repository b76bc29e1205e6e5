"""F_group: spatio-temporal clusters vote on what is dynamic (eq. 10)."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree
from torch import Tensor

from dreamdrive.decompose.flow import neighbour_flow
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry


@dataclass(frozen=True)
class GroupOptions:
    """Constants of the grouping.

    Attributes:
        threshold: tau of eq. 9: a Gaussian votes dynamic above it.
        candidate: Only Gaussians above this score are clustered; the rest is one static mass.
        reach_px: Neighbours of one source frame are at most this far apart in its image.
        reach_depth: ... and differ by at most this in the logarithm of depth.
        link: Two clusters of neighbouring frames are one if this share of the smaller lands on the other ...
        link_depth: ... and their depths differ by at most this in the logarithm: a car that passes behind
            another stays itself.
        majority: Share of votes that makes a whole cluster dynamic.
        smallest: Clusters with fewer Gaussians are static: a few stray points are no object.
        clustering: False keeps each Gaussian's own vote (for ablation).
    """

    threshold: float = 0.35
    candidate: float = 0.25
    reach_px: float = 4.5
    reach_depth: float = 0.06
    link: float = 0.4
    link_depth: float = 0.25
    majority: float = 0.4
    smallest: int = 24
    clustering: bool = True


@dataclass(frozen=True)
class Grouping:
    """Result of the vote.

    Attributes:
        dynamic: The final label (N,).
        cluster: Index of each Gaussian's space-time cluster (N,), -1 outside all dynamic clusters.
    """

    dynamic: Bool[Tensor, " n"]
    cluster: Int[Tensor, " n"]


def group(
    clip: Clip, geometry: Geometry, gaussians: Gaussians, scores: Float[Tensor, " n"], options: GroupOptions
) -> Grouping:
    """Cluster in space and time, then let the majority of each cluster decide for all of it.

    Within one source frame neighbours in the image at like depth belong together; between neighbouring frames
    clusters are joined where optical flow carries one onto the other, so that a thing keeps its cluster while
    it moves.

    Args:
        clip: Frames for the flow; held-out frames are not read.
        geometry: Cameras.
        gaussians: As seeded, with the frame each came from.
        scores: Dynamic scores (N,) in [0, 1].
        options: Constants.
    """
    value = scores.detach().numpy()
    if not options.clustering:
        dynamic = value > options.threshold
        return Grouping(torch.from_numpy(dynamic), torch.from_numpy(np.where(dynamic, 0, -1)))
    index = np.flatnonzero(value > options.candidate)
    labels = _space_time_labels(clip, geometry, gaussians, index, options)
    size = np.bincount(labels, minlength=1)
    votes = np.bincount(labels, weights=(value[index] > options.threshold).astype(float), minlength=1)
    wins = (votes > options.majority * size) & (size >= options.smallest)
    cluster = np.full(len(gaussians), -1, dtype=np.int64)
    order = np.cumsum(wins) - 1
    cluster[index[wins[labels]]] = order[labels[wins[labels]]]
    return Grouping(torch.from_numpy(cluster >= 0), torch.from_numpy(cluster))


def source_pixels(
    geometry: Geometry, gaussians: Gaussians, index: Int[np.ndarray, " m"]
) -> Float[np.ndarray, "m 3"]:
    """Column, row and depth of each Gaussian in the frame it was seeded from."""
    points = gaussians.means.detach().numpy()[index].astype(np.float64)
    frames = gaussians.source_frame.numpy()[index]
    out = np.zeros((len(index), 3))
    for frame in np.unique(frames).tolist():
        rows = frames == frame
        camera = geometry.cameras[frame]
        local = points[rows] @ camera.camera_from_world[:3, :3].T + camera.camera_from_world[:3, 3]
        z = np.maximum(local[:, 2], 1e-6)
        out[rows, 0] = local[:, 0] / z * camera.fx_px + camera.cx_px
        out[rows, 1] = local[:, 1] / z * camera.fy_px + camera.cy_px
        out[rows, 2] = z
    return out


def _space_time_labels(
    clip: Clip, geometry: Geometry, gaussians: Gaussians, index: Int[np.ndarray, " m"], options: GroupOptions
) -> Int[np.ndarray, " m"]:
    pixels = source_pixels(geometry, gaussians, index)
    frames = gaussians.source_frame.numpy()[index]
    labels = np.zeros(len(index), dtype=np.int64)
    count = 0
    for frame in np.unique(frames).tolist():
        rows = np.flatnonzero(frames == frame)
        labels[rows] = count + _components(pixels[rows], options)
        count = int(labels[rows].max()) + 1
    links = _links(clip, pixels, frames, labels, options)
    joined = connected_components(_graph(links, count), directed=False)[1]
    return joined[labels]


def _components(pixels: Float[np.ndarray, "m 3"], options: GroupOptions) -> Int[np.ndarray, " m"]:
    """Connected components of one frame's points."""
    scale = options.reach_px / options.reach_depth
    tree = KDTree(np.column_stack([pixels[:, :2], np.log(pixels[:, 2]) * scale]))
    pairs = tree.query_pairs(options.reach_px, p=np.inf, output_type="ndarray")
    return connected_components(_graph(pairs, len(pixels)), directed=False)[1]


def _graph(pairs: Int[np.ndarray, "p 2"], count: int) -> coo_matrix:
    return coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))


def _links(
    clip: Clip,
    pixels: Float[np.ndarray, "m 3"],
    frames: Int[np.ndarray, " m"],
    labels: Int[np.ndarray, " m"],
    options: GroupOptions,
) -> Int[np.ndarray, "p 2"]:
    """Pairs of clusters of neighbouring frames that flow carries onto each other."""
    seen = np.flatnonzero(~clip.held_out).tolist()
    pairs: list[tuple[int, int]] = []
    size = np.bincount(labels)
    for frame, other in pairwise(seen):
        here, there = np.flatnonzero(frames == frame), np.flatnonzero(frames == other)
        if not (len(here) and len(there)):
            continue
        flow = neighbour_flow(clip, frame, other)
        column, row = pixels[here, 0].astype(int), pixels[here, 1].astype(int)
        landed = pixels[here, :2] + flow[row.clip(0, flow.shape[0] - 1), column.clip(0, flow.shape[1] - 1)]
        distance, hit = KDTree(pixels[there, :2]).query(landed, distance_upper_bound=options.reach_px)
        hit = np.asarray(hit)
        reached = np.isfinite(distance)
        near = np.abs(np.log(pixels[there[hit[reached]], 2] / pixels[here[reached], 2])) < options.link_depth
        reached[reached] = near
        votes: dict[tuple[int, int], int] = {}
        for a, b in zip(labels[here][reached].tolist(), labels[there[hit[reached]]].tolist(), strict=True):
            votes[a, b] = votes.get((a, b), 0) + 1
        pairs += [(a, b) for (a, b), n in votes.items() if n > options.link * min(size[a], size[b])]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)
