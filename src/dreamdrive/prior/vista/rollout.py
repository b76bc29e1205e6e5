"""Rollouts: rounds of frames, each from the last ones of the round before."""

from collections.abc import Callable, Sequence

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.prior.vista.engine import Engine, Images, RoundConditions
from dreamdrive.prior.vista.kinds import ModelKind
from dreamdrive.prior.vista.memory import CHUNK
from dreamdrive.prior.vista.sampler import guidance, sample

SCALE = 0.18215
"""From the autoencoder's latents to those that are sampled."""
SHARED = 3
"""Frames that two chunks of the decoder have in common."""


def rounds_for(frames: int, kind: ModelKind, per_round: int) -> int:
    """Rounds after which so many frames are there."""
    if frames <= per_round:
        return 1
    return -(-(frames - kind.overlap) // (per_round - kind.overlap))


def roll_out(
    engine: Engine,
    kind: ModelKind,
    leading: Images,
    noise: Float[Tensor, "r t c y x"],
    actions: Sequence[Float[Tensor, " a"] | None],
    steps: int,
    *,
    first: Images | None = None,
    tell: Callable[[], None] = lambda: None,
) -> Float[Tensor, "f c y x"]:
    """Scaled latents of all frames: 25 of the first round, and what each later one adds to its overlap.

    ``noise``, of standard deviation 1, and ``actions`` are for each round; ``leading`` are one to three known
    frames, and ``first`` is the first frame as the network is given it beside the noise, where noise was
    added (SVD). ``tell`` is called after each step of the sampler.
    """
    rounds, count = noise.shape[:2]
    coded = engine.encode(leading)
    shown = coded[0] if first is None else engine.encode(first)[0]
    seen = RoundConditions(engine.describe(leading[:1]), shown, actions[0])
    known = SCALE * coded[: kind.overlap]
    several = "constant" if rounds == 1 else "triangle"
    scale = guidance("linear" if kind.overlap == 0 else several, count)
    made: Tensor | None = None
    for number in range(rounds):
        if made is not None:
            tail = decode_in_chunks(engine.decode, made[-CHUNK:] / SCALE)
            known = made[-kind.overlap :]
            seen = RoundConditions(
                engine.describe(tail[-kind.overlap][None]), known[0] / SCALE, actions[number]
            )
        mask, clean = noise.new_zeros(count), torch.zeros_like(noise[number])
        mask[: len(known)], clean[: len(known)] = 1, known
        velocity = engine.velocity(seen)
        latents = sample(velocity, noise[number], scale, mask, clean, steps, tell)
        made = latents if made is None else torch.cat([made, latents[kind.overlap :]])
    assert made is not None
    return made


def chunks(count: int, chunk: int) -> list[range]:
    """Frames of each chunk; all but the first begin where the one before still has ``SHARED`` to go."""
    shared = min(SHARED, chunk - 1)
    starts = range(0, max(count - shared, 1), chunk - shared)
    return [range(start, min(start + chunk, count)) for start in starts]


def decode_in_chunks(
    decode: Callable[[Float[Tensor, "t c h w"]], Float[Tensor, "t 3 h2 w2"]],
    latents: Float[Tensor, "f c h w"],
    chunk: int = CHUNK,
) -> Float[Tensor, "f 3 h2 w2"]:
    """Frames in [-1, 1] of latents as the autoencoder made them; what two chunks share is the mean of both.

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
