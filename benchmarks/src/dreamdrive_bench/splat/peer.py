"""Published times of OpenSplat's CPU rasteriser, and what they would be on this machine.

The peer was measured on two cores of an AMD Zen 5 with AVX-512. Its figures are scaled by the geometric mean
of two ratios of vector peaks, although it is scalar code, which gains nothing from wide vectors: this
flatters us wherever our vectors are narrower. The figures as measured are always given beside it.
"""

import math

NAME = "OpenSplat, August 2026, two threads"
MACHINE = "two cores of an AMD Zen 5, AVX-512"
THREADS = 2
PEAKS = {"fma_gflops_per_core": 257.0, "exp_g_per_core": 7.7}
# Milliseconds of forward, and of forward and backward, of the scenes in DREAMDRIVE_BENCH; best of many runs.
TIMES_MS = {"a": (68.0, 126.0), "b": (308.0, 509.0), "c": (841.0, 1421.0)}
# The version of November 2025, one thread: it can be compiled and measured here too.
OLDER_TIMES_MS = {"a": (128.0, 230.0), "b": (640.0, 1026.0), "c": (1642.0, 2653.0)}
GOAL = (8.0, 5.0)


def slowdown(peaks: dict[str, float]) -> float:
    """How many times slower this machine is, by the geometric mean of the two peaks."""
    return math.sqrt(math.prod(PEAKS[name] / peaks[name] for name in PEAKS))


def compare_older(name: str, here_ms: tuple[float, float], best_ms: tuple[float, float]) -> dict[str, object]:
    """How much slower the older version of the peer is here than where it was published, and what follows.

    It is the same program on both machines: the ratio of its times tells what scaling by peaks is worth.
    """
    slower = tuple(here / there for here, there in zip(here_ms, OLDER_TIMES_MS[name], strict=True))
    carried = tuple(factor * peer for factor, peer in zip(slower, TIMES_MS[name], strict=True))
    return {
        "slowdown": slower,
        "carried_peer_ms": carried,
        "carried_ratio": tuple(peer / ours for peer, ours in zip(carried, best_ms, strict=True)),
    }


def compare(name: str, best_ms: tuple[float, float], peaks: dict[str, float] | None) -> dict[str, object]:
    """The peer's times of common scene ``name`` and how many times faster we are, as measured and scaled."""
    times = TIMES_MS[name]
    out: dict[str, object] = {
        "peer_ms": times,
        "ratio": tuple(peer / ours for peer, ours in zip(times, best_ms, strict=True)),
        "goal": GOAL,
    }
    if peaks is not None:
        scaled = tuple(slowdown(peaks) * peer for peer in times)
        out["scaled_peer_ms"] = scaled
        out["scaled_ratio"] = tuple(peer / ours for peer, ours in zip(scaled, best_ms, strict=True))
    return out
