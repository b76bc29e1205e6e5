"""What stands, as one coloured mesh."""

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from dreamdrive.errors import InputError, installing
from dreamdrive.export.surfaces.fusion import SurfaceMesh, fuse
from dreamdrive.export.surfaces.mesh_file import write_mesh
from dreamdrive.export.surfaces.surface import Surface, surface_of
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.scene import Scene

VOXEL_M = 0.15
"""Side of a cell."""
REACH_M = 40.0
"""Depth farther away than this from every camera is too rough for a mesh."""
_MOST_VIEWS = 48
_LEAST_M2 = 0.25
"""Of a piece of the mesh that hangs together with nothing else."""
_NEAR = 0.05


def scene_to_mesh(scene: Scene, file: Path, *, replace: bool = False, progress: Progress = silent) -> None:
    """Write road and standing surfaces as a triangle mesh: PLY or GLB, as the name ends.

    Depth of what stands, as the recorded cameras see it up to ``REACH_M`` away, is fused on a grid of
    ``VOXEL_M``. Sky and what moves are left out, and what nobody saw stays open. PLY has the scene's world (x
    right, y down, z forward), GLB x right, y up, z backward; both metres, with a colour a corner.

    Args:
        scene: The scene.
        file: To write.
        replace: Take the place of an older file.
        progress: Told of each view and of each block of the grid.

    Raises:
        InputError: The package is missing, the file is there already, or nothing stands within reach.
    """
    need_scikit_image()
    made = mesh_of(scene, progress=progress)
    if not len(made.triangles):
        raise InputError(f"nothing stands within {REACH_M:g} m of the cameras, of which to make a mesh")
    write_mesh(made, file, replace=replace)


def mesh_of(
    scene: Scene, *, voxel_m: float = VOXEL_M, reach_m: float = REACH_M, progress: Progress = silent
) -> SurfaceMesh:
    """The mesh of what stands; see ``scene_to_mesh``."""
    count = len(scene.cameras)
    chosen = np.unique(np.linspace(0, count - 1, min(count, _MOST_VIEWS)).round().astype(int)).tolist()
    surfaces: list[Surface] = []
    for view in chosen:
        surfaces.append(surface_of(scene, scene.cameras[view], float(scene.times_s[view]), part="static"))
        progress(len(surfaces), 2 * len(chosen))
    places_m, triangles = fuse(
        surfaces,
        voxel_m,
        reach_m,
        lambda done, all: progress(len(chosen) * (all + done) // all, 2 * len(chosen)),
    )
    places_m, triangles = _without_crumbs(places_m, triangles)
    return SurfaceMesh(places_m, _colours(places_m, surfaces, voxel_m), triangles)


def need_scikit_image() -> None:
    """Raise ``InputError`` where the package is not installed."""
    if find_spec("skimage") is None:
        raise InputError(
            f"meshes are cut by the package scikit-image, which is not installed; {installing('mesh')}"
        )


def _without_crumbs(
    places_m: Float[np.ndarray, "n 3"], triangles: Int[np.ndarray, "t 3"]
) -> tuple[Float[np.ndarray, "m 3"], Int[np.ndarray, "u 3"]]:
    """Less the pieces that are smaller than ``_LEAST_M2``, and corners of no triangle."""
    count = len(places_m)
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    piece = connected_components(graph, directed=False)[1]
    one, other = (places_m[triangles[:, k]] - places_m[triangles[:, 0]] for k in (1, 2))
    areas_m2 = np.linalg.norm(np.cross(one, other), axis=1) / 2
    of = piece[triangles[:, 0]]
    kept = triangles[np.bincount(of, areas_m2, minlength=1)[of] >= _LEAST_M2]
    used, to = np.unique(kept, return_inverse=True)
    return places_m[used], to.reshape(-1, 3)


def _colours(
    places_m: Float[np.ndarray, "n 3"], surfaces: Sequence[Surface], voxel_m: float
) -> Float[np.ndarray, "n 3"]:
    """The mean of what views show of each place, the nearest counting most; grey where none does."""
    total, weights = np.zeros_like(places_m), np.zeros(len(places_m))
    for surface in surfaces:
        seen = surface.camera.project(places_m)
        shown = np.flatnonzero(surface.camera.shows(seen))
        column, row = seen[shown, :2].astype(int).T
        z, depth_m = seen[shown, 2], surface.depth_m[row, column]
        open_to = np.abs(z - depth_m) < _NEAR * z + voxel_m
        weight = 1 / z[open_to] ** 2
        rows = shown[open_to]
        total[rows] += weight[:, None] * surface.colour[row[open_to], column[open_to]]
        weights[rows] += weight
    return np.where(weights[:, None] > 0, total / np.maximum(weights, 1e-12)[:, None], 0.5)


def left_out_of_mesh(scene: Scene, path: Path) -> str:
    """What of a scene ``scene_to_mesh`` finds no place for, in a sentence."""
    moving = ", nothing that moves" if len(scene.dynamic) else ""
    holds = f"The mesh holds what stands within {REACH_M:g} m of the cameras: no sky{moving}"
    return f"{holds}; what no frame saw is open."
