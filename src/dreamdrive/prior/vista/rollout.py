"""Round after round: each starts from the last frames of the one before."""

from collections.abc import Callable, Sequence

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.prior.vista.decode import CHUNK, decode_in_chunks
from dreamdrive.prior.vista.engine import Engine, Images, Seen
from dreamdrive.prior.vista.kinds import Kind
from dreamdrive.prior.vista.sampler import Fixed, guidance, sample

SCALE = 0.18215
"""From the autoencoder's latents to those that are sampled."""


def rounds_for(frames: int, kind: Kind, per_round: int) -> int:
    """Rounds after which so many frames are there."""
    if frames <= per_round:
        return 1
    return -(-(frames - kind.overlap) // (per_round - kind.overlap))


def roll_out(
    engine: Engine,
    kind: Kind,
    leading: Images,
    noise: Float[Tensor, "r t c y x"],
    actions: Sequence[Float[Tensor, " a"] | None],
    steps: int,
    *,
    first: Images | None = None,
    tell: Callable[[], None] = lambda: None,
) -> Float[Tensor, "f c y x"]:
    """Scaled latents of all frames: 25 of the first round, and what each later one adds to its overlap.

    ``noise`` (R, T, C, H/8, W/8), of standard deviation 1, and ``actions`` are for each round; ``leading``
    are one to three known frames in [-1, 1], and ``first`` is the first frame as the network is given it
    beside the noise, where noise was added (SVD). ``tell`` is called after each step of the sampler.
    """
    rounds, count = noise.shape[:2]
    coded = engine.encode(leading)
    shown = coded[0] if first is None else engine.encode(first)[0]
    seen = Seen(engine.describe(leading[:1]), shown, actions[0])
    known = SCALE * coded[: kind.overlap]
    several = "constant" if rounds == 1 else "triangle"
    scale = guidance("linear" if kind.overlap == 0 else several, count)
    made: Tensor | None = None
    for number in range(rounds):
        if made is not None:
            tail = decode_in_chunks(engine.decode, made[-CHUNK:] / SCALE)
            known = made[-kind.overlap :]
            seen = Seen(engine.describe(tail[-kind.overlap][None]), known[0] / SCALE, actions[number])
        mask, clean = noise.new_zeros(count), torch.zeros_like(noise[number])
        mask[: len(known)], clean[: len(known)] = 1, known
        velocity = engine.velocity(seen)
        latents = sample(velocity, noise[number], scale, Fixed(mask, clean), steps, tell)
        made = latents if made is None else torch.cat([made, latents[kind.overlap :]])
    assert made is not None
    return made
