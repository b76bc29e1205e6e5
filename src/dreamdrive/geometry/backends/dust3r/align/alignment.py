"""Global alignment: from pairwise pointmaps to one world (Wang et al. 2024, section 3.4)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.align.aligned import Aligned, Solution, report
from dreamdrive.geometry.backends.dust3r.align.focal import FocalVotes, focal_votes
from dreamdrive.geometry.backends.dust3r.align.graph import Graph, graph_of
from dreamdrive.geometry.backends.dust3r.align.rays import Cauchy, Distance, Penalty
from dreamdrive.geometry.backends.dust3r.align.samples import draw_samples, solve_depth
from dreamdrive.geometry.backends.dust3r.align.solver import solve
from dreamdrive.geometry.backends.dust3r.align.spanning_tree import onto_known, spanning_tree
from dreamdrive.geometry.backends.dust3r.align.state import PER_EDGE, PER_IMAGE, FocalFreedom, Freedom, State
from dreamdrive.geometry.backends.dust3r.align.turned_focal import TurnedFocal, turned_focal
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps
from dreamdrive.scene.camera import check_rigid

_FLOOR = 1e-4  # of the median depth: distances below it weigh no more
_COARSE = 1e-3  # gain of a step at which the paper's loss is left for the robust one
_SAMPLE_BYTES = 32  # a point and a weight in float64
_WORK_BYTES = 1000  # of the normal equations, for each edge at each sample of one image
_MATRICES = 6  # of the size of the Hessian
_PIXEL_BYTES = 48  # of start and result: a placed point and what became of it
_FIXED_BYTES = 100_000_000


@dataclass(frozen=True)
class AlignOptions:
    """How pairs are brought together.

    Attributes:
        objective: ``distance`` is the paper's: log confidence times distance. ``robust`` goes on from there
            with relative misses under a cost that forgives outliers, and counts those across the ray more
            than those along it. It also brings each pair to the focal length that is known or shared, which
            is the one that the turns of the camera show, where they do; see ``turned_focal``.
        focal: One focal length for all images, which one camera took, or one for ``each``.
        samples_per_image: Pixels of an image that cameras and pairs are solved with; depth is solved at all.
        outlier: Relative miss from which on the robust cost grows slowly.
        sharper: How much more a miss across the ray counts than one along it, in the robust cost.
        steps: Most steps of the solver.
        memory_gb: What may be used, pointmaps included.
        seed: Of the choice of pixels.
    """

    objective: Literal["distance", "robust"] = "robust"
    focal: FocalFreedom = "shared"
    samples_per_image: int = 2000
    outlier: float = 0.05
    sharper: float = 3.0
    steps: int = 60
    memory_gb: float = 8.0
    seed: int = 0


@dataclass(frozen=True)
class KnownCameras:
    """What need not be found.

    Without pinholes, whose pixels count from 0, the focal lengths are found and the principal points in the
    middle, (W/2, H/2). With poses the scene is given in their world and unit.
    """

    intrinsics: Float[np.ndarray, "n 3 3"] | None = None
    world_from_camera: Float[np.ndarray, "n 4 4"] | None = None


def align(
    maps: PairMaps,
    options: AlignOptions | None = None,
    known: KnownCameras | None = None,
    still: Sequence[Bool[np.ndarray, "_ _"]] | None = None,
) -> Aligned:
    """Bring pairwise pointmaps into one world.

    Without known poses the world is the camera of image 0, in a unit in which the scales of the pairs have a
    geometric mean of 0.5. Confidences of exactly 1 mask pixels out. Cameras and pairs are solved with the
    ``still`` pixels of each image, all where none are given; the depth is that of all.

    Raises:
        InputError: The pairs or what is known cannot be used, or memory would not do.
    """
    options, known = options or AlignOptions(), known or KnownCameras()
    graph = graph_of(maps)
    _check_known(known, len(graph))
    if known.intrinsics is not None:
        graph = graph.through(known.intrinsics)
    storage = max(side.dtype.itemsize for pair in maps.points for side in pair)
    check_memory(graph.sizes, maps.edges, options, storage)
    with one_torch_thread():
        return _solved(maps, maps if still is None else maps.masked(still), graph, options, known)


def predicted_bytes(
    sizes: Sequence[tuple[int, int]],
    edges: Int[np.ndarray, "e 2"],
    samples_per_image: int,
    storage_bytes: int = 4,
) -> int:
    """Bytes that pointmaps, confidences and their alignment take at most at once.

    Sizes are height and width of each image; a number of the pointmaps takes ``storage_bytes``.
    """
    areas = np.array([height * width for height, width in sizes])
    degrees = np.bincount(edges.ravel(), minlength=len(areas))
    sampled = np.minimum(areas, samples_per_image)
    return int(
        4 * storage_bytes * areas[edges].sum()
        + _SAMPLE_BYTES * (degrees * sampled).sum()
        + _WORK_BYTES * (degrees * sampled).max()
        + _MATRICES * 8 * (PER_IMAGE * len(areas) + PER_EDGE * len(edges)) ** 2
        + _PIXEL_BYTES * areas.sum()
        + _FIXED_BYTES
    )


def check_memory(
    sizes: Sequence[tuple[int, int]],
    edges: Int[np.ndarray, "e 2"],
    options: AlignOptions,
    storage_bytes: int = 4,
) -> None:
    """Refuse an alignment that would not fit, before it starts."""
    predicted = predicted_bytes(sizes, edges, options.samples_per_image, storage_bytes)
    if predicted > int(options.memory_gb * 1e9):
        raise InputError(
            f"Aligning {len(sizes)} images in {len(edges)} pairs takes about {predicted / 1e9:.1f} GB, and "
            f"{options.memory_gb:.1f} GB are allowed: take fewer frames (--frames)."
        )


def _solved(
    maps: PairMaps, sure: PairMaps, graph: Graph, options: AlignOptions, known: KnownCameras
) -> Aligned:
    """Cameras and pairs from the pixels that weigh in ``sure``, depth from all."""
    votes = focal_votes(sure, graph)
    turned = None
    if options.objective == "robust" and options.focal == "shared" and known.intrinsics is None:
        turned = turned_focal(sure, votes, graph)
    focals = _first_focals(votes, turned, len(graph), options, known)
    if options.objective == "robust" and focals is not None:
        graph = replace(graph, lateral=votes.lateral(focals))
        start = spanning_tree(sure, votes.all_at(focals), graph)
    else:
        start = spanning_tree(sure, votes, graph)
    if focals is not None:
        start = replace(start, focals_px=focals)
    poses = start.world_from_camera
    if known.world_from_camera is not None:
        start, poses = onto_known(start, known.world_from_camera)
    state = State.of(poses, start.focals_px, start.pairs)
    freedom = Freedom(
        None if known.intrinsics is not None else options.focal, poses=known.world_from_camera is None
    )
    samples = draw_samples(sure, graph, options.samples_per_image, options.seed)
    penalty: Penalty = Distance(_FLOOR * float(np.median([np.median(depth) for depth in start.depth])))
    if options.objective == "robust":
        state, _ = solve(samples, state, penalty, freedom, steps=options.steps, tolerance=_COARSE)
        penalty = Cauchy(options.outlier, options.sharper)
    state, losses = solve(samples, state, penalty, freedom, steps=options.steps)
    depth, loss = solve_depth(maps, graph, state, penalty)
    return report(
        maps,
        graph,
        Solution(state, depth, loss, samples, losses),
        votes,
        turned,
        focal_known=known.intrinsics is not None,
        known_poses=known.world_from_camera,
    )


def _first_focals(
    votes: FocalVotes, turned: TurnedFocal | None, images: int, options: AlignOptions, known: KnownCameras
) -> Float[np.ndarray, " n"] | None:
    """Known ones, or the shared one; None where each image has one of its own to be found."""
    if known.intrinsics is not None:
        return known.intrinsics[:, 0, 0].astype(np.float64)
    if options.focal == "each":
        return None
    if turned is None or not turned.observed:
        return np.full(images, votes.shared_px)
    return np.full(images, turned.focal_px)


def _check_known(known: KnownCameras, images: int) -> None:
    pinholes, poses = known.intrinsics, known.world_from_camera
    if pinholes is not None:
        focals = pinholes[:, [0, 1], [0, 1]]
        if len(pinholes) != images or not (np.isfinite(pinholes).all() and (focals > 0).all()):
            raise InputError(
                f"{images} images take {images} pinholes with positive focal lengths in pixels; got "
                f"{focals.tolist()}."
            )
    if poses is None:
        return
    if len(poses) != images:
        raise InputError(f"{images} images take {images} poses; got {len(poses)}.")
    try:
        check_rigid(poses, "world_from_camera")
    except ValueError as error:
        raise InputError(f"The known poses cannot be used: {error}.") from error
