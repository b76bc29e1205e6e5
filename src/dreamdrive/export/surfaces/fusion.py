"""Depth of many views fused to one surface: a truncated signed distance, block by block.

The idea is that of Curless and Levoy (1996) and KinectFusion. Distances are taken along the surface's normal,
not along the ray: on a road that is seen at a grazing angle, they would be twenty times too large.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.export.surfaces.surface import Surface
from dreamdrive.progress import Progress

_BLOCK = 32
"""Cells of a side of a block."""
_BAND = 3.0
"""Voxels before and behind a surface in which its distance counts."""
_LEAST_COSINE = 0.02
"""Of the ray against the normal: an outline is no surface."""
_BENT = 0.1
"""Where depth along a row or a column bends by more, as a share, there is an outline."""


@dataclass(frozen=True)
class SurfaceMesh:
    """Triangles: places in the world, RGB in [0, 1], and corners, from outside counter-clockwise."""

    places_m: Float[np.ndarray, "n 3"]
    colours: Float[np.ndarray, "n 3"]
    triangles: Int[np.ndarray, "t 3"]


@dataclass(frozen=True)
class _View:
    """A surface with what fusing it takes: no depth at outlines; the cosine of each ray to its normal."""

    surface: Surface
    depth_m: Float[np.ndarray, "h w"]
    cosine: Float[np.ndarray, "h w"]

    @property
    def farthest_m(self) -> float:
        """Its largest depth."""
        return float(self.depth_m.max())


def fuse(
    surfaces: Sequence[Surface], voxel_m: float, reach_m: float, progress: Progress
) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "t 3"]]:
    """Corners and triangles of the surface that views see together; holes stay holes.

    Args:
        surfaces: Of single views.
        voxel_m: Side of a cell.
        reach_m: Depth farther away does not count.
        progress: Told of each block.
    """
    views = [_view(each, reach_m) for each in surfaces]
    places: list[np.ndarray] = []
    triangles: list[np.ndarray] = []
    blocks, count = _blocks(views, voxel_m), 0
    for done, block in enumerate(blocks):
        found = _meshed(*_distances(block, views, voxel_m))
        if found is not None:
            places.append((found[0] + block * _BLOCK) * voxel_m)
            triangles.append(found[1] + count)
            count += len(found[0])
        progress(done + 1, len(blocks))
    if not places:
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    return _joined(np.concatenate(places), np.concatenate(triangles), voxel_m)


def _view(surface: Surface, reach_m: float) -> _View:
    depth_m = np.where(surface.depth_m <= reach_m, surface.depth_m, 0.0).astype(np.float32)
    inverse = 1 / np.maximum(depth_m, 1e-3)
    # On a plane 1 / z is linear in columns and rows.
    bend = sum(np.abs(cv2.Sobel(inverse, cv2.CV_32F, *way, ksize=3)) for way in ((2, 0), (0, 2))) / 4
    points = surface.camera.rays() * depth_m[..., None]
    across, down = np.gradient(points, axis=1), np.gradient(points, axis=0)
    normal = np.cross(across, down)
    ray = surface.camera.rays()
    lengths = np.linalg.norm(normal, axis=-1) * np.linalg.norm(ray, axis=-1)
    cosine = np.abs((normal * ray).sum(axis=-1)) / np.maximum(lengths, 1e-12)
    kept = (depth_m > 0) & (bend * depth_m < _BENT) & (cosine > _LEAST_COSINE)
    return _View(surface, np.where(kept, depth_m, 0.0), cosine.astype(np.float32))


def _blocks(views: Sequence[_View], voxel_m: float) -> Int[np.ndarray, "b 3"]:
    """The blocks that a surface may cross."""
    found: list[np.ndarray] = []
    for view in views:
        rows, columns = np.nonzero(view.depth_m)
        pixels = np.column_stack([columns + 0.5, rows + 0.5, view.depth_m[rows, columns]])
        points = view.surface.camera.lift(pixels) / (voxel_m * _BLOCK)
        for beside in product((-1 / _BLOCK, 1 / _BLOCK), repeat=3):
            found.append(_once(np.floor(points + beside).astype(int))[0])
    return _once(np.concatenate(found))[0]


def _distances(
    block: Int[np.ndarray, "3"], views: Sequence[_View], voxel_m: float
) -> tuple[Float[np.ndarray, "s s s"], Bool[np.ndarray, "s s s"]]:
    """Signed distance in voxels at the corners of a block's cells, above 0 outside, and where it is known."""
    side, band_m = _BLOCK + 1, _BAND * voxel_m
    corners = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    places = ((corners + block * _BLOCK) * voxel_m).astype(np.float64)
    total, weights = np.zeros(len(places)), np.zeros(len(places))
    middle, radius_m = places.mean(axis=0), voxel_m * side
    for view in views:
        camera = view.surface.camera
        ahead_m = (middle - camera.world_from_camera[:3, 3]) @ camera.world_from_camera[:3, 2]
        if not -radius_m < ahead_m < view.farthest_m + radius_m:
            continue
        seen = camera.project(places)
        shown = np.flatnonzero(camera.shows(seen))
        column, row = seen[shown, :2].astype(int).T
        depth_m = view.depth_m[row, column]
        away_m = (depth_m - seen[shown, 2]) * view.cosine[row, column]
        near = (depth_m > 0) & (away_m > -band_m)
        weight = view.cosine[row, column][near] / depth_m[near] ** 2
        total[shown[near]] += weight * np.minimum(away_m[near], band_m)
        weights[shown[near]] += weight
    known = weights > 0
    distance = np.where(known, total / np.maximum(weights, 1e-12), band_m) / voxel_m
    return distance.reshape(side, side, side), known.reshape(side, side, side)


def _meshed(
    distance: Float[np.ndarray, "s s s"], known: Bool[np.ndarray, "s s s"]
) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "t 3"]] | None:
    """Corners and triangles, in cells, of cells of which all eight corners are known; None of no triangle."""
    from skimage.measure import marching_cubes

    whole = np.ones(np.array(known.shape) - 1, bool)
    for x, y, z in product((0, 1), repeat=3):
        whole &= known[x : x + len(whole), y : y + len(whole), z : z + len(whole)]
    # It asks for the mask of a cell at the last of its corners.
    mask = np.pad(whole, ((1, 0),) * 3)
    signs = distance[known]
    if not mask.any() or not signs.size or signs.min() >= 0 or signs.max() <= 0:
        return None
    try:
        found: Any = marching_cubes(distance, 0.0, mask=mask, gradient_direction="descent")
    except RuntimeError:  # where no cell that counts is crossed
        return None
    return found[0].astype(np.float64), found[1].astype(int)


def _joined(
    places: Float[np.ndarray, "n 3"], triangles: Int[np.ndarray, "t 3"], voxel_m: float
) -> tuple[Float[np.ndarray, "m 3"], Int[np.ndarray, "u 3"]]:
    """Corners of neighbouring blocks that are the same as one, and no triangle that has lost its area."""
    cells = np.rint(places / voxel_m * 100).astype(int)
    _, first, to = _once(cells)
    joined = to[triangles]
    a, b, c = joined.T
    return places[first], joined[(a != b) & (b != c) & (a != c)]


def _once(
    rows: Int[np.ndarray, "n 3"],
) -> tuple[Int[np.ndarray, "m 3"], Int[np.ndarray, " m"], Int[np.ndarray, " n"]]:
    """Each row once, where it is first, and which one each row is; NumPy sorts rows as such slowly."""
    low = rows.min(axis=0, initial=0)
    sides = rows.max(axis=0, initial=0) - low + 1
    keys = np.ravel_multi_index(tuple((rows - low).T), tuple(sides.tolist()))
    _, first, to = np.unique(keys, return_index=True, return_inverse=True)
    return rows[first], first, to
