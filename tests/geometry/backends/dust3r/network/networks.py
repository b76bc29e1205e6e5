"""Networks with seeded weights: a tiny one, and those of the golden numbers."""

import math
import zlib
from functools import cache
from typing import Any

import numpy as np
import torch
from torch import Tensor

from dreamdrive.geometry.backends.dust3r.network.checkpoint import normalise
from dreamdrive.geometry.backends.dust3r.network.config import DptSizes, NetworkConfig, config_from_keywords
from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r
from dreamdrive.models.weights import fill_network
from tests.golden import reading

TINY = NetworkConfig(
    enc_dim=32,
    enc_depth=1,
    enc_heads=2,
    dec_dim=24,
    dec_depth=4,
    dec_heads=2,
    dpt=DptSizes((8, 8, 8, 8), feature_dim=8, last_dim=4),
)
"""A network for tests that need no golden numbers."""


def config_of(settings: dict[str, Any]) -> NetworkConfig:
    """A model of ``net_config.json``."""
    bounded = {key: _bounds(settings["config"][key]) for key in ("depth_mode", "conf_mode")}
    config = config_from_keywords(settings["config"] | bounded, "golden")
    if "dpt" not in settings:
        return config
    sizes = settings["dpt"]
    dpt = DptSizes(tuple(sizes["layer_dims"]), sizes["feature_dim"], sizes["last_dim"])
    return NetworkConfig(**(config.__dict__ | {"dpt": dpt}))


def golden_network(model: str) -> Dust3r:
    """A model of ``net_config.json`` with its weights."""
    settings = reading.values("dust3r/net_config.json")[model]
    config = config_of(settings)
    recipe = settings["weights"] == "recipe"
    state = seeded_state(config) if recipe else reading.tensors(f"dust3r/net_{model}_weights.safetensors")
    return fill_network(lambda: Dust3r(config), normalise(state, model), model, model)


def _bounds(mode: list[Any]) -> tuple[Any, ...]:
    return (mode[0], *map(float, mode[1:]))


def seeded_state(config: NetworkConfig) -> dict[str, Tensor]:
    """Weights by the rule of the README: normal, scaled by what each entry is, seeded by its name."""
    with torch.device("meta"):
        shapes = {key: value.shape for key, value in Dust3r(config).state_dict().items()}
    return {key: _seeded(key, tuple(shape)) for key, shape in shapes.items() if ".layer_rn." not in key}


def _seeded(key: str, shape: tuple[int, ...]) -> Tensor:
    seed = zlib.crc32(key.encode())
    z = np.random.RandomState(seed).standard_normal(math.prod(shape)).reshape(shape)
    *_, module, kind = ("", *key.split("."))
    if module.startswith(("norm", "enc_norm", "dec_norm")) and kind == "weight":
        z = 1 + 0.1 * z
    elif kind == "bias":
        z = 0.1 * z
    elif kind == "mask_token":
        z = 0.02 * z
    else:
        transposed = key.endswith(("act_postprocess.0.1.weight", "act_postprocess.1.1.weight"))
        z = z / math.sqrt(shape[0] if transposed else math.prod(shape[1:]))
    if key.endswith(("dpt.head.4.weight", "downstream_head1.proj.weight", "downstream_head2.proj.weight")):
        z = 0.3 * z
    return torch.from_numpy(z.astype(np.float32))


def tiny(**changes: Any) -> Dust3r:
    """A small network with seeded weights."""
    if changes.get("head") == "linear":
        changes["dpt"] = DptSizes()  # which a file of a linear head does not tell
    config = NetworkConfig(**(TINY.__dict__ | changes))
    state = {key: value.clone() for key, value in _tiny_state(config).items()}
    return fill_network(lambda: Dust3r(config), normalise(state, "tiny"), "tiny", "tiny")


_tiny_state = cache(seeded_state)
