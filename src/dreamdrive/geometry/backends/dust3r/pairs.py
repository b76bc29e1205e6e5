"""Which pairs of frames the network looks at."""

import re

import numpy as np
from jaxtyping import Int

from dreamdrive.errors import InputError

_FORMS = "complete, swin[-K][-noncyclic], logwin[-K][-noncyclic], oneref[-R]"
_GRAPH = re.compile(r"(complete)|(swin|logwin)(?:-(\d+))?(-noncyclic)?|(oneref)(?:-(\d+))?")
_FILTER = re.compile(r"(seq|cyc)(\d+)")
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


def make_pairs(
    frames: int, graph: str = "swin-3-noncyclic", *, symmetrise: bool = True, prefilter: str | None = None
) -> Int[np.ndarray, "e 2"]:
    """Pairs (E, 2) of frame indices; a frame is never paired with itself.

    Args:
        frames: Number of frames, at least 2.
        graph: One of

            - ``complete``: all pairs,
            - ``swin-K``: frames up to K apart, 3 where no K is given,
            - ``logwin-K``: frames 1, 2, 4 ... 2^(K-1) apart,
            - ``oneref-R``: frame R with each other one, 0 where no R is given.

            Windows close into a circle unless the name ends in ``-noncyclic``.
        symmetrise: Whether each pair also comes in reverse, after all others.
        prefilter: ``seqD`` keeps the pairs at most D apart, ``cycD`` those at most D apart on the circle.

    Raises:
        InputError: Fewer than two frames, a graph or filter of another form, or no pair is left.
    """
    if frames < 2:
        raise InputError(f"{frames} frames make no pair; at least 2 are needed")
    pairs = _of_graph(frames, graph)
    if symmetrise:
        pairs = pairs + [(j, i) for i, j in pairs]
    if prefilter is not None:
        pairs = _filtered(pairs, prefilter)
    if not pairs:
        raise InputError(f"graph {graph!r} with the filter {prefilter!r} leaves no pair of {frames} frames")
    return np.array(pairs, dtype=np.int64)


def _of_graph(frames: int, graph: str) -> list[Pair]:
    match = _GRAPH.fullmatch(graph)
    if match is None:
        raise InputError(f"graph {graph!r} is unknown; expected {_FORMS}")
    complete, window, size, noncyclic, _, reference = match.groups()
    if complete:
        return [(i, j) for i in range(frames) for j in range(i)]
    if window:
        count = min(_WINDOW if size is None else int(size), frames)  # more of them pair nothing new
        if count < 1:
            raise InputError(f"graph {graph!r}: the window has to be at least 1")
        steps = [1 + i if window == "swin" else 2**i for i in range(count)]
        return _within(frames, steps, cyclic=noncyclic is None)
    centre = 0 if reference is None else int(reference)
    if centre >= frames:
        raise InputError(f"graph {graph!r}: there are only frames 0 to {frames - 1}")
    return [(centre, j) for j in range(frames) if j != centre]


def _within(frames: int, steps: list[int], *, cyclic: bool) -> list[Pair]:
    found = {
        (min(i, j), max(i, j))
        for i in range(frames)
        for j in ((i + step) % frames if cyclic else i + step for step in steps)
        if i != j and j < frames
    }
    return sorted(found)


def _filtered(pairs: list[Pair], prefilter: str) -> list[Pair]:
    match = _FILTER.fullmatch(prefilter)
    if match is None:
        raise InputError(f"prefilter {prefilter!r} is unknown; expected seqD or cycD with a number D")
    most = int(match.group(2))
    count = 1 + max(max(pair) for pair in pairs)

    def apart(i: int, j: int) -> int:
        return min(abs(i - j), count - abs(i - j)) if match.group(1) == "cyc" else abs(i - j)

    return [(i, j) for i, j in pairs if apart(i, j) <= most]
