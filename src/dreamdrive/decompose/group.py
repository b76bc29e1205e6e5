"""F_group: spatio-temporal clusters vote on what is dynamic (eq. 10)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_matrix, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree
from torch import Tensor

from dreamdrive.decompose.density import density_labels, voted
from dreamdrive.decompose.on_road import on_road
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.vision.flow import carried, cells, neighbour_flow
from dreamdrive.vision.linked_pixels import linked_pixels


@dataclass(frozen=True)
class GroupOptions:
    """Constants of the grouping; what they are worth: docs/results/ablation.md.

    Attributes:
        threshold: tau of eq. 9: a Gaussian votes dynamic above it.
        candidate: Only Gaussians above this score are clustered; the rest is one static mass.
        reach_depth: Neighbours of one source frame differ by at most this in the logarithm of depth.
        link: Share of the strongest label's points that keeps a label which flow carries: less is noise.
        link_depth: Log depth by which flow's labels may differ: a car that passes behind stays itself.
        join: Labels that hang together in this share of their common frames are one thing.
        majority: Share of votes that makes a whole cluster dynamic, if it has a core.
        certain: Score above which a member is one of the core.
        core: Least share of the core: foliage and railings, fitted badly everywhere a little, have none.
        smallest: Clusters with fewer Gaussians are static: a few stray points are no object.
        road: What lies lower over the road than this share of the camera's height is road; None: no test.
        clusters: By ``"flow"``, by HDBSCAN (``"density"``, the paper), or each for itself (``"none"``).
        users: Whether a road user that the street network sees, and that was followed, is one cluster.
    """

    threshold: float = 0.35
    candidate: float = 0.25
    reach_depth: float = 0.06
    link: float = 0.2
    link_depth: float = 0.3
    join: float = 0.7
    majority: float = 0.4
    certain: float = 0.6
    core: float = 0.1
    smallest: int = 24
    road: float | None = 0.1
    clusters: Literal["flow", "density", "none"] = "flow"
    users: bool = True


@dataclass(frozen=True)
class Grouping:
    """Result of the vote.

    Attributes:
        dynamic: The final label (N,).
        cluster: Index of each Gaussian's space-time cluster (N,), -1 outside all dynamic clusters.
    """

    dynamic: Bool[Tensor, " n"]
    cluster: Int[Tensor, " n"]

    @property
    def static(self) -> Bool[Tensor, " n"]:
        """What the scene's static part is made of (N,)."""
        return ~self.dynamic


def group(
    clip: Clip,
    geometry: Geometry,
    gaussians: Gaussians,
    scores: Float[Tensor, " n"],
    options: GroupOptions,
    reach_px: float,
) -> Grouping:
    """Cluster in space and time, then let the majority of each cluster decide for all of it.

    Within one source frame neighbours in the image at like depth belong together; from frame to frame optical
    flow carries labels on, so that a thing keeps its cluster while it moves. Neighbours are at most
    ``reach_px`` apart, see ``SeedOptions``. Held-out frames are not read; scores are in [0, 1].
    """
    value = scores.detach().numpy()
    votes = value > options.threshold
    if options.clusters == "none":
        return _grouping(np.where(votes, 0, -1))
    if options.clusters == "density":
        number = (np.cumsum(~clip.held_out) - 1)[gaussians.source_frame.numpy()]
        labels = density_labels(gaussians.means.detach().numpy(), number, value, options.smallest)
        return _grouping(voted(labels, votes.astype(np.float64), options.majority))
    index = np.flatnonzero(value > options.candidate)
    points = source_pixels(geometry, gaussians, index)
    frames = gaussians.source_frame.numpy()[index]
    labels = _labels(clip, geometry, points, frames, options, reach_px)
    upright = ~on_road(points[:, :2], frames, labels, _low(geometry, gaussians, index, options))
    wins = elected(labels[upright], value[index[upright]], options)
    members = upright & np.isin(labels, wins)
    cluster = np.full(len(gaussians), -1, dtype=np.int64)
    cluster[index[members]] = np.searchsorted(wins, labels[members])
    return _grouping(cluster)


def _labels(
    clip: Clip,
    geometry: Geometry,
    points: Float[np.ndarray, "m 3"],
    frames: Int[np.ndarray, " m"],
    options: GroupOptions,
    reach_px: float,
) -> Int[np.ndarray, " m"]:
    """One label a thing: road users that were followed are one each; flow joins the rest."""
    if geometry.road_users is None or not options.users:
        return _space_time_labels(clip, points, frames, options, reach_px)
    user = geometry.road_users[frames, *cells(points, geometry.road_users.shape[1:])].astype(np.int64)
    labels, rest = user - 1, user == 0
    others = _space_time_labels(clip, points[rest], frames[rest], options, reach_px)
    labels[rest] = others + int(user.max(initial=0))
    return labels


def _low(
    geometry: Geometry, gaussians: Gaussians, index: Int[np.ndarray, " m"], options: GroupOptions
) -> Bool[np.ndarray, " m"]:
    """Which Gaussians lie in the plane of the road."""
    ground = geometry.ground
    if ground is None or options.road is None:
        return np.zeros(len(index), dtype=bool)
    points = gaussians.means.detach().numpy()[index].astype(np.float64)
    return ground.height_m(points) < options.road * ground.offset_m


def elected(
    labels: Int[np.ndarray, " m"], scores: Float[np.ndarray, " m"], options: GroupOptions
) -> Int[np.ndarray, " k"]:
    """Labels, from 0, of the clusters that vote dynamic (eq. 10), in order."""
    size = np.bincount(labels)
    votes = np.bincount(labels, weights=(scores > options.threshold).astype(float))
    core = np.bincount(labels, weights=(scores > options.certain).astype(float))
    wins = (votes > options.majority * size) & (core >= options.core * size) & (size >= options.smallest)
    return np.flatnonzero(wins)


def _grouping(cluster: Int[np.ndarray, " n"]) -> Grouping:
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
        out[rows] = geometry.cameras[frame].project(points[rows])
    out[:, 2] = np.maximum(out[:, 2], 1e-6)
    return out


def _space_time_labels(
    clip: Clip,
    points: Float[np.ndarray, "m 3"],
    frames: Int[np.ndarray, " m"],
    options: GroupOptions,
    reach_px: float,
) -> Int[np.ndarray, " m"]:
    """One label a thing: components of a frame take over the labels that flow carries onto their points.

    Labels are handed on point by point, so that two cars that come to touch in the image keep theirs. Parts
    of one thing that began with labels of their own are joined when they hang together most of the time.
    """
    labels = np.full(len(points), -1, dtype=np.int64)
    component = np.full(len(points), -1, dtype=np.int64)
    for before, frame in _successive(clip):
        rows = np.flatnonzero(frames == frame)
        if not len(rows):
            continue
        component[rows] = component.max() + 1 + linked_pixels(points[rows], reach_px, options.reach_depth)
        earlier = np.flatnonzero(frames == before) if before is not None else rows[:0]
        if before is not None and len(earlier):
            flow = neighbour_flow(clip, before, frame)
            labels[rows] = _handed_on(points[earlier], labels[earlier], flow, points[rows], options, reach_px)
        labels[rows] = _completed(labels[rows], component[rows], int(labels.max()) + 1, options)
    return _joined(labels, component, frames, options) if len(labels) else labels


def _successive(clip: Clip) -> list[tuple[int | None, int]]:
    """The frames that may be seen, each after the one before it of the same camera."""
    cameras = np.unique(clip.camera).tolist()
    return [
        pair for c in cameras for pair in zip([None, *clip.seen_of(c)[:-1]], clip.seen_of(c), strict=True)
    ]


def _handed_on(
    sources: Float[np.ndarray, "s 3"],
    labels: Int[np.ndarray, " s"],
    flow: Float[np.ndarray, "h w 2"],
    points: Float[np.ndarray, "m 3"],
    options: GroupOptions,
    reach_px: float,
) -> Int[np.ndarray, " m"]:
    """Label of the nearest point of the frame before after flow, at like depth; -1 where there is none."""
    tree = KDTree(carried(sources[:, :2], flow))
    found = tree.query(points[:, :2], distance_upper_bound=reach_px)
    distance, nearest = np.asarray(found[0]), np.asarray(found[1])
    reached = np.isfinite(distance)
    nearest = np.where(reached, nearest, 0)
    like = np.abs(np.log(sources[nearest, 2] / points[:, 2])) < options.link_depth
    return np.where(reached & like, labels[nearest], -1)


def _completed(
    labels: Int[np.ndarray, " m"], component: Int[np.ndarray, " m"], fresh: int, options: GroupOptions
) -> Int[np.ndarray, " m"]:
    """Give every point of one frame a label: the strongest of its component's, or a fresh one."""
    labels = labels.copy()
    for one in np.unique(component).tolist():
        members = np.flatnonzero(component == one)
        known, counts = np.unique(labels[members][labels[members] >= 0], return_counts=True)
        if not len(known):
            labels[members] = fresh
            fresh += 1
            continue
        strong = known[counts >= max(options.link * counts.max(), 1)]
        lost = members[~np.isin(labels[members], strong)]
        labels[lost] = known[counts.argmax()]
    return labels


def _joined(
    labels: Int[np.ndarray, " m"],
    component: Int[np.ndarray, " m"],
    frames: Int[np.ndarray, " m"],
    options: GroupOptions,
) -> Int[np.ndarray, " m"]:
    """Labels of parts that share a component in most of the frames in which both are there, made one."""
    count = int(labels.max()) + 1
    present, within = _incidence(labels, frames), _incidence(labels, component)
    both_there, together = (present @ present.T).tocoo(), (within @ within.T).tocsr()
    life = present.sum(axis=1)
    a, b, common = both_there.row, both_there.col, both_there.data
    shared = np.asarray(together[a, b]).ravel()
    same = (shared >= options.join * common) & (common >= 0.5 * np.minimum(life[a], life[b]))
    pairs = np.column_stack([a[same], b[same]])
    return connected_components(_graph(pairs, count), directed=False)[1][labels]


def _graph(pairs: Int[np.ndarray, "p 2"], count: int) -> coo_matrix:
    return coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))


def _incidence(labels: Int[np.ndarray, " m"], columns: Int[np.ndarray, " m"]) -> csr_array:
    """1 where a label occurs together with a column, else 0."""
    pairs = np.unique(np.column_stack([labels, columns]), axis=0)
    return csr_array((np.ones(len(pairs), dtype=np.int64), (pairs[:, 0], pairs[:, 1])))
