"""Peak memory and seconds of one alignment, in a process that has done nothing else.

    python -m geometry.memory_run FRAMES WIDTH HEIGHT GRAPH DTYPE GB

Prints JSON. What is resident at the peak holds Python, its libraries and the pointmaps.
"""

import json
import sys
import time
from typing import Any

import numpy as np
from jaxtyping import Int

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r import PairMaps, make_pairs
from dreamdrive.geometry.backends.dust3r.align import AlignOptions, align, predicted_bytes
from dreamdrive_bench.common.memory import peak_bytes, resident_bytes
from dreamdrive_bench.geometry.alignment import EASY, RATE_HZ
from dreamdrive_bench.geometry.simulated_pairs import Truth, pair_maps, truth_of
from dreamdrive_bench.geometry.worlds import world_of

_COARSER = 4  # the drive is drawn so many times smaller: what alignment costs does not depend on detail


def enlarged(truth: Truth, factor: int) -> Truth:
    """The drive at ``factor`` times the size, each pixel a block of equal ones."""

    def repeated(values: np.ndarray) -> np.ndarray:
        return values.repeat(factor, axis=1).repeat(factor, axis=2)

    return Truth(
        depth=repeated(truth.depth.astype(np.float32)),
        world_from_camera=truth.world_from_camera,
        focal_px=truth.focal_px * factor,
        offset_px=truth.offset_px,
        instance=None if truth.instance is None else repeated(truth.instance.astype(np.uint8)),
        centres=truth.centres,
    )


def refused(
    frames: int, size: tuple[int, int], graph: str, dtype: type[np.floating], memory_gb: float
) -> str | None:
    """What ``align`` says where it would not start; the pointmaps are one pair's, over and over."""
    points, trust = np.zeros((size[1], size[0], 3), dtype), np.full((size[1], size[0]), 2, dtype)
    edges = make_pairs(frames, graph)
    maps = PairMaps(edges, ((points, points),) * len(edges), ((trust, trust),) * len(edges))
    areas = [(size[1], size[0])] * frames
    if predicted_bytes(areas, edges, AlignOptions().samples_per_image, dtype().itemsize) <= 1e9 * memory_gb:
        return None
    try:
        align(maps, AlignOptions(memory_gb=memory_gb))
    except InputError as error:
        return str(error)
    return None


def measure(
    frames: int, size: tuple[int, int], graph: str, dtype: type[np.floating], memory_gb: float
) -> dict[str, Any]:
    """Bytes and processor seconds of one alignment, or why it was refused."""
    edges = make_pairs(frames, graph)
    areas = [(size[1], size[0])] * frames
    predicted = predicted_bytes(areas, edges, AlignOptions().samples_per_image, dtype().itemsize)
    told: dict[str, Any] = {"edges": len(edges), "predicted_bytes": predicted}
    if (why := refused(frames, size, graph, dtype, memory_gb)) is not None:
        return {**told, "refused": why}
    before = resident_bytes()
    maps = _pairs(frames, size, edges, dtype)
    resident_bytes()  # what drawing took is given back before the peak is looked for
    began = time.process_time()
    peak = peak_bytes(lambda: align(maps, AlignOptions(memory_gb=memory_gb)))
    return {**told, "before_bytes": before, "peak_bytes": peak, "seconds": time.process_time() - began}


def _pairs(
    frames: int, size: tuple[int, int], edges: Int[np.ndarray, "e 2"], dtype: type[np.floating]
) -> PairMaps:
    small = size[0] // _COARSER, size[1] // _COARSER
    truth = enlarged(truth_of(world_of("bend a", frames, RATE_HZ, small)), _COARSER)
    world_of.cache_clear()
    return pair_maps(truth, edges, EASY, dtype=dtype)


def main() -> None:
    """Measure what the command line says."""
    frames, width, height, graph, dtype, memory_gb = sys.argv[1:]
    kind = {"float16": np.float16, "float32": np.float32}[dtype]
    print(json.dumps(measure(int(frames), (int(width), int(height)), graph, kind, float(memory_gb))))


if __name__ == "__main__":
    main()
