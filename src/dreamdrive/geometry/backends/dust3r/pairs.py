"""Pairs of frames for the network, and their pointmaps."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.errors import InputError

_FORMS = "complete, swin[-K][-noncyclic], logwin[-K][-noncyclic]"
_GRAPH = re.compile(r"(complete)|(swin|logwin)(?:-(\d+))?(-noncyclic)?")
_WINDOW = 3  # where none is named
_SHORT = 24  # frames; a chain of windows over more of them drifts

Pair = tuple[int, int]


def video_graph(frames: int) -> str:
    """The graph for a clip: neighbours within three frames, or up to 16 frames apart where the clip is long.

    Windows do not close into a circle: the first and the last frame of a drive see nothing in common.

    Of 48 frames round a bend noisy pairs, made by ``benchmarks/geometry.py``, leave the path 0.38 % of its
    length off with ``swin-3`` (276 pairs; mean of three draws) and 0.05 % with ``logwin-5`` (418 pairs) in
    1.6 times the seconds; of 24 frames 0.13 and 0.06 %. With three times the noise where the first camera of
    a pair does not look, which is nearer to a network, 0.28 and 0.07 % (48 frames, one draw).
    """
    return "swin-3-noncyclic" if frames <= _SHORT else "logwin-5-noncyclic"


def make_pairs(frames: int, graph: str = "swin-3-noncyclic") -> Int[np.ndarray, "e 2"]:
    """Pairs of frame indices, all in reverse at the end; a frame is never paired with itself.

    The graph is ``complete``; or ``swin-K``, frames up to K apart, 3 where no K is given; or ``logwin-K``,
    frames 1, 2, 4 ... 2^(K-1) apart. Windows close into a circle unless the name ends in ``-noncyclic``.
    """
    if frames < 2:
        raise InputError(f"{frames} frames make no pair; at least 2 are needed")
    pairs = _of_graph(frames, graph)
    return np.array(pairs + [(j, i) for i, j in pairs], dtype=np.int64)


def _of_graph(frames: int, graph: str) -> list[Pair]:
    match = _GRAPH.fullmatch(graph)
    if match is None:
        raise InputError(f"graph {graph!r} is unknown; expected {_FORMS}")
    complete, window, size, noncyclic = match.groups()
    if complete:
        return [(i, j) for i in range(frames) for j in range(i)]
    count = min(_WINDOW if size is None else int(size), frames)  # more of them pair nothing new
    if count < 1:
        raise InputError(f"graph {graph!r}: the window has to be at least 1")
    steps = [1 + i if window == "swin" else 2**i for i in range(count)]
    found = {
        (min(i, j), max(i, j))
        for i in range(frames)
        for j in (i + step if noncyclic else (i + step) % frames for step in steps)
        if i != j and j < frames
    }
    return sorted(found)


@dataclass(frozen=True)
class PairMaps:
    """Points and confidences of both images of each pair, whose indices i and j are its edge.

    Points of image i and of image j are both in the frame of camera i (x right, y down, z forward), up to a
    scale of each pair's own. Confidences are at least 1 in the published models. Images may differ in shape.
    """

    edges: Int[np.ndarray, "e 2"]
    points: tuple[tuple[Float[np.ndarray, "_ _ 3"], Float[np.ndarray, "_ _ 3"]], ...]
    confidence: tuple[tuple[Float[np.ndarray, "_ _"], Float[np.ndarray, "_ _"]], ...]

    def __post_init__(self) -> None:
        if not len(self.edges) == len(self.points) == len(self.confidence):
            raise ValueError(
                f"{len(self.edges)} pairs, but points of {len(self.points)} "
                f"and confidences of {len(self.confidence)}"
            )
        for edge, points, confidence in zip(self.edges, self.points, self.confidence, strict=True):
            if any(p.shape[:2] != c.shape for p, c in zip(points, confidence, strict=True)):
                raise ValueError(f"pair {tuple(edge.tolist())}: points and confidence differ in shape")

    def __len__(self) -> int:
        return len(self.edges)

    def masked(self, usable: Sequence[Bool[np.ndarray, "_ _"]]) -> "PairMaps":
        """With a confidence of 1, which weighs nothing, where an image (H, W) is not usable."""

        def kept(image: int, trust: Float[np.ndarray, "_ _"]) -> Float[np.ndarray, "_ _"]:
            return np.where(usable[image], trust, trust.dtype.type(1))

        confidence = tuple(
            (kept(i, first), kept(j, second))
            for (i, j), (first, second) in zip(self.edges.tolist(), self.confidence, strict=True)
        )
        return replace(self, confidence=confidence)
