"""Rounds and decoding in chunks, with stand-ins for the networks, against the public code."""

import itertools
from typing import Any

import pytest
import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d

from dreamdrive.prior.vista.engine import Engine, RoundConditions
from dreamdrive.prior.vista.kinds import SVD, VISTA
from dreamdrive.prior.vista.memory import CHUNK
from dreamdrive.prior.vista.rollout import SCALE, SHARED, chunks, decode_in_chunks, roll_out, rounds_for
from dreamdrive.prior.vista.sampler import Branches, Velocity
from tests.golden.reading import cases, close, tensors

FILE = "vista/rollout_standin.safetensors"
STEPS = 4
"""Of each round, which no entry tells."""
LIMIT = 1e-5
"""Of the largest value: each round starts from the rounding of the one before."""


def engine_of(**methods: Any) -> Engine:
    """An engine without networks."""
    made = object.__new__(Engine)
    vars(made).update(methods)
    return made


def stand_in(given: dict[str, Tensor], described: list[Tensor]) -> Engine:
    """The golden README's linear networks; notes which images are described."""

    def encode(images: Tensor) -> Tensor:
        return torch.einsum("oc,bchw->bohw", given["enc"], avg_pool2d(images, 2))

    def decode(latents: Tensor) -> Tensor:
        small = torch.einsum("oc,bchw->bohw", given["dec"], latents)
        large = small.repeat_interleave(2, 2).repeat_interleave(2, 3)
        return large + 0.01 * torch.arange(len(latents))[:, None, None, None]

    def describe(images: Tensor) -> Tensor:
        described.append(images)
        return images.mean(dim=(0, 2, 3))

    def velocity(seen: RoundConditions) -> Velocity:
        def answer(x: Tensor, time: float, mask: Tensor) -> Branches:
            rest = 0.05 * time + 0.1 * mask[:, None, None, None]
            made = [
                torch.einsum(
                    "oc,bchw->bohw", given["net"], torch.cat([x, (on * seen.latent).expand_as(x)], 1)
                )
                + 0.1 * on * seen.image.mean()
                + rest
                for on in (0, 1)
            ]
            return made[0], made[1]

        return answer

    return engine_of(encode=encode, decode=decode, describe=describe, velocity=velocity)


@pytest.mark.parametrize("rounds", cases(FILE, r"r(\d+)\.latents"))
def test_golden_rounds(rounds: str) -> None:
    given, described = tensors(FILE), list[Tensor]()
    model, expected = stand_in(given, described), given.under(f"r{rounds}.")
    told: list[None] = []
    count = len(expected["noise"])
    made = roll_out(
        model,
        VISTA,
        given["images"][:1],
        expected["noise"],
        [None] * count,
        STEPS,
        tell=lambda: told.append(None),
    )
    assert len(told) == STEPS * count
    close(made, expected["latents"], LIMIT)
    close(torch.cat(described), expected["cond_img"], LIMIT)
    decoded = (decode_in_chunks(model.decode, expected["latents"] / SCALE) + 1) / 2
    # Ten times the limit: of what the clamp leaves, which is little of the frames.
    close(decoded.clamp(0, 1), expected["frames"], 10 * LIMIT)


@pytest.mark.parametrize("count", cases(FILE, r"decode_in_(\d+)"))
def test_golden_chunks_overlap_by_their_mean(count: str) -> None:
    given = tensors(FILE)
    made = decode_in_chunks(stand_in(given, []).decode, given[f"decode_in_{count}"] / SCALE)
    close(made, given[f"decode_out_{count}"], LIMIT)


@pytest.mark.parametrize("chunk", [1, 2, 4, 14])
@pytest.mark.parametrize("count", [1, 3, 14, 25, 47])
def test_chunks_cover_all_frames(count: int, chunk: int) -> None:
    parts = chunks(count, chunk)
    assert {i for part in parts for i in part} == set(range(count))
    assert all(0 < len(part) <= chunk for part in parts)
    assert all(
        first.stop - second.start == min(SHARED, chunk - 1) for first, second in itertools.pairwise(parts)
    )
    latents = torch.randn(count, 4, 2, 2)
    made = decode_in_chunks(lambda z: z[:, :3], latents, chunk)
    torch.testing.assert_close(made, latents[:, :3])


def test_first_and_second_chunk_are_vistas() -> None:
    assert chunks(25, CHUNK) == [range(0, 14), range(11, 25)]


def test_rounds_for_so_many_frames() -> None:
    assert [rounds_for(n, VISTA, 25) for n in (2, 25, 26, 47, 48, 69)] == [1, 1, 2, 2, 3, 3]
    assert rounds_for(25, SVD, 25) == 1


def test_leading_frames_stay_and_svd_fixes_none() -> None:
    images = torch.rand(3, 3, 4, 6) * 2 - 1
    seen: list[Tensor] = []

    def velocity(conditions: RoundConditions) -> Velocity:
        def answer(x: Tensor, time: float, mask: Tensor) -> Branches:
            seen.append(mask)
            return x, x

        return answer

    def encode(images: Tensor) -> Tensor:
        return avg_pool2d(images, 2)

    def describe(images: Tensor) -> Tensor:
        return images.mean(dim=(0, 2, 3))

    model = engine_of(encode=encode, decode=encode, describe=describe, velocity=velocity)
    noise = torch.randn(1, 5, 3, 2, 3)
    made = roll_out(model, VISTA, images, noise, [None], 2)
    torch.testing.assert_close(made[:3], SCALE * encode(images))
    assert seen[0].tolist() == [1, 1, 1, 0, 0]
    roll_out(model, SVD, images[:1], noise, [None], 2)
    assert not seen[-1].any()
