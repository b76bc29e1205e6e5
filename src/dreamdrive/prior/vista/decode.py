"""From latents to frames, a few at a time."""

from collections.abc import Callable

from jaxtyping import Float
from torch import Tensor

CHUNK, SHARED = 14, 3
"""Frames that Vista decodes at once, and how many of them two chunks have in common."""

Decode = Callable[[Float[Tensor, "t c h w"]], Float[Tensor, "t 3 h2 w2"]]
"""From latents, as the autoencoder made them, to frames in [-1, 1]."""


def chunks(count: int, chunk: int) -> list[range]:
    """Frames of each chunk; all but the first begin where the one before still has ``SHARED`` to go."""
    shared = min(SHARED, chunk - 1)
    starts = range(0, max(count - shared, 1), chunk - shared)
    return [range(start, min(start + chunk, count)) for start in starts]


def decode_in_chunks(
    decode: Decode, latents: Float[Tensor, "t c h w"], chunk: int = CHUNK
) -> Float[Tensor, "t 3 h2 w2"]:
    """Frames of latents, as the autoencoder made them; what two chunks have in common is the mean of both.

    The decoder mixes the ``chunk`` frames that it is given at once.
    """
    made: Tensor | None = None
    reached = 0
    for part in chunks(len(latents), chunk):
        frames = decode(latents[part.start : part.stop]).cpu()
        if made is None:
            made = frames.new_empty((len(latents), *frames.shape[1:]))
        common = reached - part.start
        if common > 0:
            made[part.start : reached] = (made[part.start : reached] + frames[:common]) / 2
        made[reached : part.stop] = frames[max(common, 0) :]
        reached = part.stop
    assert made is not None
    return made
