"""Round after round: each starts from the last frames of the one before."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.prior.vista.decode import CHUNK, Decode, decode_in_chunks
from dreamdrive.prior.vista.kinds import Kind
from dreamdrive.prior.vista.sampler import Fixed, Schedule, Velocity, guidance, sample

SCALE = 0.18215
"""From the autoencoder's latents to those that are sampled."""

Images = Float[Tensor, "n 3 h w"]
"""Frames in [-1, 1]."""


@dataclass(frozen=True)
class Seen:
    """The conditions of one round.

    Attributes:
        image: Description of its first frame (D,).
        latent: That frame as the autoencoder has it, not scaled (C, h, w).
        action: Columns of the action (A,); None without one, as in SVD.
    """

    image: Float[Tensor, " d"]
    latent: Float[Tensor, "c h w"]
    action: Float[Tensor, " a"] | None


@dataclass(frozen=True)
class Model:
    """What is asked of the networks.

    Attributes:
        encode: From frames to latents, the mode, not scaled.
        decode: From such latents back to frames.
        describe: From one frame to what CLIP says of it.
        velocity: The network of the sampler, given the conditions of a round.
    """

    encode: Callable[[Images], Float[Tensor, "n c h w"]]
    decode: Decode
    describe: Callable[[Images], Float[Tensor, " d"]]
    velocity: Callable[[Seen], Velocity]


def rounds_for(frames: int, kind: Kind, per_round: int) -> int:
    """Rounds after which so many frames are there."""
    if frames <= per_round:
        return 1
    return -(-(frames - kind.overlap) // (per_round - kind.overlap))


def roll_out(
    model: Model,
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

    Args:
        model: The networks.
        kind: Which model they are.
        leading: One to three known frames in [-1, 1].
        noise: For each round (R, T, C, H/8, W/8), of standard deviation 1.
        actions: For each round.
        steps: Of the sampler in each round.
        first: The first frame as the network is given it beside the noise, where noise was added (SVD).
        tell: Called after each step.
    """
    rounds, count = noise.shape[:2]
    coded = model.encode(leading)
    shown = coded[0] if first is None else model.encode(first)[0]
    seen = Seen(model.describe(leading[:1]), shown, actions[0])
    known = SCALE * coded[: kind.overlap]
    scale = guidance(_schedule(kind, rounds), count)
    made: Tensor | None = None
    for number in range(rounds):
        if made is not None:
            tail = decode_in_chunks(model.decode, made[-CHUNK:] / SCALE)
            image = tail[-kind.overlap][None]
            known = made[-kind.overlap :]
            seen = Seen(model.describe(image), known[0] / SCALE, actions[number])
        velocity = model.velocity(seen)
        latents = sample(velocity, noise[number], scale, _fix(known, noise[number]), steps, tell)
        made = latents if made is None else torch.cat([made, latents[kind.overlap :]])
    assert made is not None
    return made


def _schedule(kind: Kind, rounds: int) -> Schedule:
    if kind.overlap == 0:
        return "linear"
    return "constant" if rounds == 1 else "triangle"


def _fix(known: Float[Tensor, "k c h w"], noise: Float[Tensor, "t c h w"]) -> Fixed:
    mask, latents = noise.new_zeros(len(noise)), torch.zeros_like(noise)
    mask[: len(known)] = 1
    latents[: len(known)] = known
    return Fixed(mask, latents)
