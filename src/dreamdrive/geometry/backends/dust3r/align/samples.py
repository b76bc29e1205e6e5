"""Sampled pixels for the solver, and the pass over all pixels at its end."""

import numpy as np
import torch
from jaxtyping import Float, Int

from dreamdrive.geometry.backends.dust3r.align.graph import Graph
from dreamdrive.geometry.backends.dust3r.align.normal import ImageSamples
from dreamdrive.geometry.backends.dust3r.align.rays import Penalty, RayMisses, pixel_rays
from dreamdrive.geometry.backends.dust3r.align.state import State
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps

_CHUNK = 8192  # pixels at a time, so that their arrays stay in the cache
_FULL_STEPS = 12


def _areas(maps: PairMaps) -> Float[np.ndarray, "2"]:
    """What the paper's loss divides by: the pixels of all edges' first, and second, images."""
    return np.array([[side.size for side in pair] for pair in maps.confidence], np.float64).sum(axis=0)


def draw_samples(maps: PairMaps, graph: Graph, per_image: int, seed: int) -> list[ImageSamples]:
    """Up to ``per_image`` pixels of each image that weigh anything, one at random in each stretch of them."""
    areas, random = _areas(maps), np.random.default_rng(seed)
    drawn: list[ImageSamples] = []
    for image, halves in enumerate(graph.halves):
        counts = np.any([maps.confidence[half.edge][half.side].ravel() > 1 for half in halves], axis=0)
        some = _stretches(np.flatnonzero(counts), per_image, random)
        stands_for = np.count_nonzero(counts) / len(some)
        points = np.zeros((len(halves), len(some), 3))
        weight = np.zeros((len(halves), len(some)))
        for k, half in enumerate(halves):
            trust = np.log(maps.confidence[half.edge][half.side].ravel()[some], dtype=np.float64)
            weight[k] = stands_for * trust / areas[half.side]
            xyz = graph.shaped(half.edge, maps.points[half.edge][half.side].reshape(-1, 3)[some])
            points[k] = np.where(trust[:, None] > 0, xyz, 0)
        edges = tuple(half.edge for half in halves)
        tensors = (torch.from_numpy(array) for array in (graph.pixels(image, some), points, weight))
        drawn.append(ImageSamples(image, edges, some, *tensors))
    return drawn


def _stretches(which: Int[np.ndarray, " n"], most: int, random: np.random.Generator) -> Int[np.ndarray, " m"]:
    if len(which) <= most:
        return which
    return which[((np.arange(most) + random.random(most)) * (len(which) / most)).astype(np.intp)]


def solve_depth(
    maps: PairMaps, graph: Graph, state: State, penalty: Penalty
) -> tuple[tuple[Float[np.ndarray, "_ _"], ...], float]:
    """The best depth along z of each image given all else, and the cost summed over all pixels.

    Depth is positive, float32; a pixel that no edge weighs gets the median of its image, since nothing is
    known of it. A chunk of pixels is solved at a time; none is copied for longer.
    """
    areas = _areas(maps)
    depths: list[np.ndarray] = []
    loss = 0.0
    for image, halves in enumerate(graph.halves):
        size = graph.sizes[image]
        parts = [state.camera_from_edge(image, half.edge) for half in halves]
        shapes = [graph.shape(half.edge) for half in halves]
        parts = [(matrix * shape, shift) for (matrix, shift), shape in zip(parts, shapes, strict=True)]
        matrices, shifts = (torch.from_numpy(np.stack(part)).float() for part in zip(*parts, strict=True))
        clouds = [maps.points[half.edge][half.side].reshape(-1, 3) for half in halves]
        trusts = [(maps.confidence[half.edge][half.side].ravel(), areas[half.side]) for half in halves]
        depth = torch.zeros(size[0] * size[1])
        known = torch.zeros(size[0] * size[1], dtype=torch.bool)
        for first in range(0, len(depth), _CHUNK):
            some = slice(first, min(first + _CHUNK, len(depth)))
            pixels = graph.pixels(image, np.arange(some.start, some.stop)).astype(np.float32)
            rays = pixel_rays(torch.from_numpy(pixels), float(state.focal_px[image]))
            logs = [np.log(trust[some], dtype=np.float32) / np.float32(area) for trust, area in trusts]
            weight = torch.from_numpy(np.stack(logs))
            points = torch.from_numpy(np.stack([cloud[some].astype(np.float32) for cloud in clouds]))
            points = torch.where(weight[..., None] > 0, points, 0.0)
            misses = RayMisses.of(rays, torch.baddbmm(shifts[:, None], points, matrices.mT), weight)
            middle = misses.middle()
            depth[some] = misses.depth(middle, penalty, middle, _FULL_STEPS)
            known[some] = weight.sum(dim=0) > 0
            loss += float(misses.cost(depth[some], penalty, middle)[0].sum(dtype=torch.float64))
        depth[~known] = depth[known].median()
        depths.append(depth.numpy().reshape(size))
    return tuple(depths), loss
