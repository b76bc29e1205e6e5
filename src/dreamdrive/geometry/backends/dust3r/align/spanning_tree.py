"""First guess of all cameras, joined along the tree of the most trusted pairs."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.sparse import coo_array
from scipy.sparse.csgraph import minimum_spanning_tree

from dreamdrive.geometry.backends.dust3r.align.focal import FocalVotes, focal_votes, weiszfeld_px
from dreamdrive.geometry.backends.dust3r.align.graph import Graph, graph_of
from dreamdrive.geometry.backends.dust3r.align.registration import pose_by_pnp, register
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps
from dreamdrive.scene.similarity import Similarity

BASE_SCALE = 0.5  # geometric mean of the scales of all pairs
_PNP_CONFIDENCE = 3.0  # above which the authors' program uses a pixel
_PNP_STEPS = 10
_ROBUST_STEPS = 5
_REGISTERED = 2_000  # pixels of a pair that are registered
_STANDING = 1e-9  # spread of a path that has no length of its own
_NEAREST = 0.01  # quantile of the valid depths that replaces those behind the camera


@dataclass(frozen=True)
class AlignmentStart:
    """Where an alignment begins. The world is any; the scales of the pairs have a geometric mean of 0.5."""

    world_from_camera: Float[np.ndarray, "n 4 4"]
    focals_px: Float[np.ndarray, " n"]
    depth: tuple[Float[np.ndarray, "_ _"], ...]  # along z, positive
    pairs: tuple[Similarity, ...]  # from the frame of each edge's first camera to the world


def spanning_tree(
    maps: PairMaps,
    votes: FocalVotes | None = None,
    graph: Graph | None = None,
    *,
    upstream: bool = False,
    stale_focals: bool = True,
) -> AlignmentStart:
    """Join pairs from the strongest on; then pose each image in what was joined.

    Pairs weigh by mean confidence of the first times that of the second image. Each next pair of the maximum
    spanning tree is registered to the points of the image that is already placed, and places the other one.

    Where this departs from the authors' program: weights are log confidences, so masked pixels do not count;
    registrations are robust; the focal length of an image comes from its own pointmaps, by the robust rule;
    poses come from the registration of an own pointmap rather than from PnP; points behind a camera get a
    small depth rather than depth 1.

    With ``upstream`` all of it is done as the authors' program does, votes aside; with ``stale_focals`` it
    also takes an image's focal length from the pair handled before.
    """
    graph = graph or graph_of(maps)
    tree = _Tree(maps, graph, votes, upstream, stale_focals)
    tree.grow()
    tree.find_focals()
    tree.find_poses()
    return tree.start()


class _Tree:
    """The state of the walk: points of placed images, and focal lengths and poses as far as known."""

    def __init__(
        self, maps: PairMaps, graph: Graph, votes: FocalVotes | None, upstream: bool, stale_focals: bool
    ) -> None:
        self.maps, self.graph, self.votes, self.upstream = maps, graph, votes, upstream
        self.stale_focals = stale_focals
        self.edge_of = {(int(i), int(j)): edge for edge, (i, j) in enumerate(maps.edges)}
        trust = np.positive if upstream else np.log
        self.scores = np.prod([[float(trust(c).mean()) for c in pair] for pair in maps.confidence], axis=1)
        self.points: dict[int, np.ndarray] = {}
        self.poses: dict[int, np.ndarray] = {}
        self.focals: dict[int, float] = {}

    def _strongest_first(self) -> list[tuple[int, int]]:
        """Edges of the tree, (first, second) image."""
        count = len(self.graph)
        weights = coo_array((-self.scores, tuple(self.maps.edges.T)), shape=(count, count)).tocsr()
        found = minimum_spanning_tree(weights).tocoo()
        order = sorted(zip(found.data.tolist(), found.row.tolist(), found.col.tolist(), strict=True))
        return [(i, j) for _, i, j in order]

    def grow(self) -> None:
        """Place the points of all images."""
        waiting = self._strongest_first()
        first = waiting.pop(0)
        before = edge = self.edge_of[first]
        for image, points in zip(first, self.maps.points[edge], strict=True):
            self.points[image] = self.graph.shaped(edge, points.astype(np.float32, copy=False))
        self.poses[first[0]] = np.eye(4)
        if self.upstream:
            self.focals[first[0]] = self._focal(edge)
        while waiting:
            i, j = waiting.pop(0)
            edge = self.edge_of[i, j]
            if self.upstream and i not in self.focals:
                self.focals[i] = self._focal(before if self.stale_focals else edge)
            if i not in self.points and j not in self.points:
                waiting.append((i, j))
                continue
            side = 0 if i in self.points else 1
            placed, other = (i, j)[side], (i, j)[1 - side]
            joined = self._register(edge, side, self.points[placed])
            self.points[other] = joined(self.graph.shaped(edge, self.maps.points[edge][1 - side]))
            self.poses.setdefault(i, _rigid(joined))
            before = edge

    def _focal(self, edge: int) -> float:
        return weiszfeld_px(self.maps.points[edge][0])

    def _register(self, edge: int, side: int, target: np.ndarray) -> Similarity:
        points, trust = self.maps.points[edge][side], self.maps.confidence[edge][side]
        if self.upstream:
            return register(points, target, trust)
        stride = max(1, round(np.sqrt(trust.size / _REGISTERED)))
        some = np.s_[stride // 2 :: stride, stride // 2 :: stride]
        weights = np.log(trust[some])
        if np.count_nonzero(weights) < 3:
            some, weights = np.s_[:, :], np.log(trust)
        source = self.graph.shaped(edge, points[some])
        return register(source, target[some], weights, robust_steps=_ROBUST_STEPS)

    def _by_strength(self) -> list[int]:
        return np.argsort(-self.scores, kind="stable").tolist()

    def find_focals(self) -> None:
        """Focal lengths of all images."""
        count = len(self.graph)
        if not self.upstream:
            votes = self.votes or focal_votes(self.maps, self.graph)
            self.focals = dict(enumerate(votes.per_image_px(count).tolist()))
            return
        for edge in self._by_strength():
            image = int(self.maps.edges[edge, 0])
            if image not in self.focals:
                self.focals[image] = self._focal(edge)

    def find_poses(self) -> None:
        """Poses of images that were the first of no edge in the tree."""
        if not self.upstream:
            for edge in self._by_strength():
                image = int(self.maps.edges[edge, 0])
                if image not in self.poses:
                    self.poses[image] = _rigid(self._register(edge, 0, self.points[image]))
        for image in range(len(self.graph)):
            if image not in self.poses:
                self.poses[image] = self._pose_by_pnp(image)

    def _pose_by_pnp(self, image: int) -> np.ndarray:
        trusts = [self.maps.confidence[half.edge][half.side] for half in self.graph.halves[image]]
        trust = np.max(trusts, axis=0)
        threshold = _PNP_CONFIDENCE if self.upstream else 1.0
        cx, cy = self.graph.principal_px[image].tolist()
        stretch = float(self.graph.stretch[image])
        focal = self.focals.get(image)
        found = pose_by_pnp(self.points[image], trust > threshold, focal, _PNP_STEPS, (cx, cy), stretch)
        if found is not None:
            self.focals[image], pose = found
            return pose
        if self.upstream:
            return np.eye(4)
        partner = next(int(i) for i, j in self.maps.edges if j == image)
        return self.poses.get(partner, np.eye(4)).copy()

    def start(self) -> AlignmentStart:
        """All of it in the scale in which the pairs' scales have a geometric mean of 0.5."""
        pairs = [self._register(edge, 0, self.points[int(i)]) for edge, (i, _) in enumerate(self.maps.edges)]
        scale = BASE_SCALE / np.exp(np.mean([np.log(pair.scale) for pair in pairs]))
        poses = np.stack([self.poses[image] for image in range(len(self.graph))])
        poses[:, :3, 3] *= scale
        points = [np.float32(scale) * self.points[image] for image in range(len(self.graph))]
        return AlignmentStart(
            world_from_camera=poses,
            focals_px=np.array([self.focals[image] for image in range(len(self.graph))]),
            depth=tuple(self._depth(xyz, pose) for xyz, pose in zip(points, poses, strict=True)),
            pairs=tuple(Similarity(scale * p.scale, p.rotation, scale * p.translation) for p in pairs),
        )

    def _depth(self, points: Float[np.ndarray, "h w 3"], pose: np.ndarray) -> Float[np.ndarray, "h w"]:
        centre, axis = (pose[:3, column].astype(points.dtype) for column in (3, 2))
        z = ((points - centre) @ axis).astype(np.float32)
        if self.upstream:
            return np.where(z > 0, z, np.float32(1))
        valid = z[z > 0]
        least = np.quantile(valid, _NEAREST) if len(valid) else np.float32(1)
        return np.where(z > least, z, np.float32(least))


def _rigid(similarity: Similarity) -> Float[np.ndarray, "4 4"]:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = similarity.rotation, similarity.translation
    return pose


def onto_known(
    start: AlignmentStart, world_from_camera: Float[np.ndarray, "n 4 4"]
) -> tuple[AlignmentStart, Float[np.ndarray, "n 4 4"]]:
    """The start in the known world, and the known poses in the unit in which the pairs' scales average 0.5.

    The unit is not that of the known poses: were the scales of pairs free, the loss could fall while the
    clouds shrink. One factor between the two is left for the solver.
    """
    similarity = register(
        _marks(start.world_from_camera), _marks(world_from_camera), np.ones(4 * len(world_from_camera))
    )
    scales = np.array([similarity.scale * pair.scale for pair in start.pairs])
    unit = float(BASE_SCALE / np.exp(np.log(scales).mean()))
    pairs = tuple(
        Similarity(
            unit * similarity.scale * pair.scale,
            similarity.rotation @ pair.rotation,
            unit * similarity(pair.translation),
        )
        for pair in start.pairs
    )
    poses = world_from_camera.astype(np.float64)
    poses[:, :3, 3] *= unit
    depth = tuple((unit * similarity.scale * each).astype(each.dtype) for each in start.depth)
    return replace(start, world_from_camera=poses, pairs=pairs, depth=depth), poses


def _marks(poses: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "m 3"]:
    """Centres, and points along all axes as far out as these spread: a straight path alone leaves a roll."""
    centres = poses[:, :3, 3]
    spread = float(np.sqrt(np.square(centres - centres.mean(axis=0)).sum(axis=1).mean()))
    reach = spread if spread > _STANDING else 1.0
    axes = [centres + reach * poses[:, :3, axis] for axis in range(3)]
    return np.concatenate([centres, *axes])
