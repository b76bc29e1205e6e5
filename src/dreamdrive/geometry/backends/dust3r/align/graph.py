"""The graph of image pairs: what it must be so that its images can be brought together."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps

_FEWEST = 10  # pixels that weigh, of an image in an edge


@dataclass(frozen=True)
class Half:
    """What one edge says of one of its images: the first, side 0, or the second."""

    edge: int
    side: int


@dataclass(frozen=True)
class Graph:
    """Images and the halves of edges that hold pointmaps of them.

    The ``lateral`` factor on x and y of an edge's points gives its first pointmap the focal length to be
    used; 1 leaves them as they are.
    """

    sizes: tuple[tuple[int, int], ...]  # height and width
    halves: tuple[tuple[Half, ...], ...]
    principal_px: Float[np.ndarray, "n 2"]  # column and row, pixels counted from 0
    stretch: Float[np.ndarray, " n"]  # fx / fy; rows times it have the focal length of columns
    lateral: Float[np.ndarray, " e"]

    def __len__(self) -> int:
        return len(self.sizes)

    def through(self, intrinsics: Float[np.ndarray, "n 3 3"]) -> "Graph":
        """The same with these pinholes, whose pixels count from 0."""
        stretch = intrinsics[:, 0, 0] / intrinsics[:, 1, 1]
        return replace(self, principal_px=intrinsics[:, :2, 2], stretch=stretch)

    def shaped(self, edge: int, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Points of an edge with its ``lateral`` factor, in their own precision."""
        return points if self.lateral[edge] == 1 else points * self.shape(edge).astype(points.dtype)

    def shape(self, edge: int) -> Float[np.ndarray, "3"]:
        """Factors on x, y and z of an edge's points."""
        return np.array([self.lateral[edge], self.lateral[edge], 1.0])

    def pixels(self, image: int, some: Int[np.ndarray, " p"]) -> Float[np.ndarray, "p 2"]:
        """Columns and stretched rows relative to the principal point, of pixels by row-major index."""
        width, (cx, cy) = self.sizes[image][1], self.principal_px[image]
        return np.stack([some % width - cx, (some // width - cy) * self.stretch[image]], axis=1)


def graph_of(maps: PairMaps) -> Graph:
    """Check pairs for what would spoil an alignment; principal points are in the middle, (W/2, H/2).

    Raises:
        InputError: Sizes contradict each other, an image is in no pair or has hardly a pixel that weighs, a
            pointmap or confidence is not finite where it counts, or the pairs fall into separate parts.
    """
    if not len(maps.edges) or maps.edges.min() < 0 or (maps.edges[:, 0] == maps.edges[:, 1]).any():
        raise InputError("Pairs must be of two different images each, counted from 0, and there must be one.")
    halves: list[list[Half]] = [[] for _ in range(int(maps.edges.max()) + 1)]
    for edge, pair in enumerate(maps.edges):
        for side in (0, 1):
            halves[int(pair[side])].append(Half(edge, side))
    absent = [image for image, mine in enumerate(halves) if not mine]
    if absent:
        raise InputError(f"{_images(absent)} in no pair; alignment takes every image at least once.")
    sizes = tuple(maps.confidence[mine[0].edge][mine[0].side].shape for mine in halves)
    _check_values(maps, sizes)
    _check_connected(maps, len(halves))
    middles = np.array([(width / 2, height / 2) for height, width in sizes])
    each = tuple(tuple(mine) for mine in halves)
    return Graph(sizes, each, middles, stretch=np.ones(len(sizes)), lateral=np.ones(len(maps)))


def _check_values(maps: PairMaps, sizes: tuple[tuple[int, ...], ...]) -> None:
    empty: set[int] = set()
    broken: set[int] = set()
    for pair, points, confidence in zip(maps.edges, maps.points, maps.confidence, strict=True):
        for image, xyz, trust in zip(map(int, pair), points, confidence, strict=True):
            if trust.shape != sizes[image]:
                raise InputError(
                    f"Image {image} is {sizes[image]} (height, width) in one pair and {trust.shape} in "
                    "another; an image has one size."
                )
            counts = trust != 1
            if not (np.isfinite(trust).all() and (trust >= 1).all() and np.isfinite(xyz[counts]).all()):
                broken.add(image)
            elif np.count_nonzero(counts) < _FEWEST:
                empty.add(image)
    if broken:
        raise InputError(
            f"{_images(sorted(broken))} given NaN or infinite points where the confidence is above 1, or "
            "confidences below 1; mask such pixels with a confidence of exactly 1."
        )
    if empty:
        raise InputError(
            f"{_images(sorted(empty))} left with fewer than {_FEWEST} pixels of confidence above 1 in a "
            "pair; mask less, or leave these images out."
        )


def _check_connected(maps: PairMaps, count: int) -> None:
    ends = maps.edges.T
    parts, part = connected_components(
        coo_array((np.ones(len(maps.edges)), tuple(ends)), shape=(count, count)), False
    )
    if parts > 1:
        lists = "; ".join(str(np.flatnonzero(part == number).tolist()) for number in range(parts))
        raise InputError(
            f"The pairs leave {parts} groups of images without a link between them: {lists}. "
            "Add pairs between the groups, or align each alone."
        )


def _images(which: list[int]) -> str:
    if len(which) == 1:
        return f"Image {which[0]} is"
    return f"Images {', '.join(map(str, which))} are"
