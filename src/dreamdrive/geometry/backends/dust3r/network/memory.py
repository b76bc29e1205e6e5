"""Memory that the network will take, told before it is taken."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.network.config import NetworkConfig
from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r

Size = tuple[int, int]
"""Height and width in pixels."""

_FLOAT = 4  # bytes
# Vectors as wide as a token that a block holds at once, beside its inner linear layer: the tokens before and
# after, normed, queries, keys and values, these turned, and what is taken from them.
_TOKEN_COPIES = 12
# Images as wide as the last convolution, at full resolution, that are held at once. Measured at 512x288: 5.4
# for a single pair, for which the library that convolves chooses another way, 3.2 for each of four.
_LAST_COPIES = 6
_MOST_AT_ONCE = 8  # larger batches are no faster on a processor


@dataclass(frozen=True)
class MemoryPlan:
    """Bytes that the inference on a set of pairs takes, and how many are looked at in one batch."""

    weights: int
    tokens: int  # of the encoded frames, kept until the last pair
    outputs: int
    image: int  # working memory to encode one frame of the largest shape
    pair: int  # and to decode one pair
    images_at_once: int
    pairs_at_once: int

    @property
    def working(self) -> int:
        """Working memory of the larger of the two steps."""
        return max(self.images_at_once * self.image, self.pairs_at_once * self.pair)

    @property
    def total(self) -> int:
        """All of it."""
        return self.weights + self.tokens + self.outputs + self.working

    def __str__(self) -> str:
        return (
            f"{_gb(self.total)}: weights {_gb(self.weights)}, encoded frames {_gb(self.tokens)}, "
            f"results {_gb(self.outputs)}, work on {self.pairs_at_once} at once {_gb(self.working)}"
        )


def plan_memory(
    network: Dust3r, sizes: Sequence[Size], edges: Int[np.ndarray, "e 2"], budget_bytes: int
) -> MemoryPlan:
    """What the inference on pairs of frames will take, in batches as large as the budget allows.

    Where not even one pair at a time fits it is refused.
    """
    config = network.config
    used = {int(i): sizes[int(i)] for i in edges.flatten()}
    weights = sum(part.nbytes for part in network.parameters())
    tokens = sum(_FLOAT * _tokens(config, size) * config.enc_dim for size in used.values())
    outputs = sum(_FLOAT * 4 * _area(sizes[int(i)]) for i in edges.flatten())
    image = max((_encoding(config, size) for size in used.values()), default=0)
    pair = max((_decoding(config, sizes[int(i)], sizes[int(j)]) for i, j in edges), default=0)
    left = budget_bytes - weights - tokens - outputs
    plan = MemoryPlan(weights, tokens, outputs, image, pair, _at_once(left, image), _at_once(left, pair))
    if plan.total > budget_bytes:
        raise InputError(
            f"DUSt3R on {len(edges)} pairs of {len(used)} frames needs {plan}; "
            f"allowed are {_gb(budget_bytes)}: take fewer frames (--frames)"
        )
    return plan


def _at_once(left: int, each: int) -> int:
    return min(max(left // max(each, 1), 1), _MOST_AT_ONCE)


def _encoding(config: NetworkConfig, size: Size) -> int:
    block = _TOKEN_COPIES * config.enc_dim + 2 * config.hidden(config.enc_dim)
    return _FLOAT * (3 * _area(size) + _tokens(config, size) * block)


def _decoding(config: NetworkConfig, first: Size, second: Size) -> int:
    """Layers of both decoders are kept for the heads, which run one after the other."""
    tokens = _tokens(config, first) + _tokens(config, second)
    block = _TOKEN_COPIES * config.dec_dim + 2 * config.hidden(config.dec_dim)
    kept = tokens * (config.enc_dim + config.dec_depth * config.dec_dim)
    wide = _LAST_COPIES * config.dpt.last_dim if config.head == "dpt" else 16
    return _FLOAT * (kept + max(tokens * block, max(_area(first), _area(second)) * wide))


def _tokens(config: NetworkConfig, size: Size) -> int:
    return _area(size) // config.patch**2


def _area(size: Size) -> int:
    return size[0] * size[1]


def _gb(count: int) -> str:
    return f"{count / 1e9:.2f} GB"
