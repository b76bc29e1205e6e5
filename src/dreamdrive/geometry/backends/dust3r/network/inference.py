"""The network on all pairs of a set of frames."""

import logging
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float, Int, UInt8

from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r, Tokens
from dreamdrive.geometry.backends.dust3r.network.heads import Pointmap
from dreamdrive.geometry.backends.dust3r.network.images import as_input
from dreamdrive.geometry.backends.dust3r.network.memory import Size, plan_memory
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps
from dreamdrive.progress import Progress, silent

BUDGET_BYTES = 8 * 10**9
"""Memory allowed by default. Not what the machine has free: the size of a batch shows in the last digits."""

_Maps = tuple[Float[np.ndarray, "_ _ 3"], Float[np.ndarray, "_ _"]]
_log = logging.getLogger("dreamdrive")


@torch.inference_mode()
def infer(
    network: Dust3r,
    pictures: Sequence[UInt8[np.ndarray, "_ _ 3"]],
    edges: Int[np.ndarray, "e 2"],
    *,
    budget_bytes: int = BUDGET_BYTES,
    progress: Progress = silent,
) -> PairMaps:
    """Points and confidences of all pairs of pictures, RGB, whose shapes may differ; each is encoded once.

    Memory may be taken up to the budget, the weights included. Progress is told after each batch of the
    frames and pairs done, of all of them.

    Raises:
        InputError: Not even one pair at a time fits into the memory allowed.
        ValueError: A pair names a picture that is not there.
    """
    if edges.size and not (edges.min() >= 0 and edges.max() < len(pictures)):
        raise ValueError(f"pairs name frames {edges.min()} to {edges.max()}; there are {len(pictures)}")
    sizes = [(picture.shape[0], picture.shape[1]) for picture in pictures]
    plan = plan_memory(network, sizes, edges, budget_bytes)
    used = sorted({int(i) for i in edges.flatten()})
    # A warning, since less is not shown and it may be all of what the machine has.
    _log.warning("DUSt3R on %d pairs of %d frames takes %s", len(edges), len(used), plan)
    done, total = 0, len(used) + len(edges)
    encoded: dict[int, Tokens] = {}
    for batch in _batches([sizes[i] for i in used], plan.images_at_once):
        frames = [used[k] for k in batch]
        encoded |= zip(frames, _encode(network, [pictures[i] for i in frames]), strict=True)
        progress(done := done + len(batch), total)
    maps: dict[int, tuple[_Maps, _Maps]] = {}
    for batch in _batches([(sizes[i], sizes[j]) for i, j in edges.tolist()], plan.pairs_at_once):
        first, second = ([encoded[i] for i in edges[batch, side].tolist()] for side in (0, 1))
        decoded = network.decode(_joined(first), _joined(second))
        for k, a, b in zip(batch, *(_separate(part) for part in decoded), strict=True):
            maps[k] = (a, b)
        progress(done := done + len(batch), total)
    ordered = [maps[k] for k in range(len(edges))]
    return PairMaps(
        edges=edges,
        points=tuple((a[0], b[0]) for a, b in ordered),
        confidence=tuple((a[1], b[1]) for a, b in ordered),
    )


def _batches(kinds: Sequence[Size | tuple[Size, Size]], most: int) -> Iterator[list[int]]:
    """Indices in batches of one kind each, at most so many at once."""
    groups: dict[object, list[int]] = defaultdict(list)
    for index, kind in enumerate(kinds):
        groups[kind].append(index)
    for group in groups.values():
        for start in range(0, len(group), most):
            yield group[start : start + most]


def _encode(network: Dust3r, pictures: list[UInt8[np.ndarray, "_ _ 3"]]) -> list[Tokens]:
    device = network.enc_norm.weight.device
    tokens = network.encode(as_input(pictures).to(device))
    return [replace(tokens, values=values) for values in tokens.values.split(1)]


def _joined(tokens: list[Tokens]) -> Tokens:
    return replace(tokens[0], values=torch.cat([each.values for each in tokens]))


def _separate(maps: Pointmap) -> list[_Maps]:
    points, confidence = (np.ascontiguousarray(part.cpu().numpy()) for part in (maps.points, maps.confidence))
    return list(zip(points, confidence, strict=True))
