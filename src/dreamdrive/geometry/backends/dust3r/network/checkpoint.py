"""Weights of DUSt3R from a file: the authors' ``.pth`` or the hub's ``.safetensors`` and ``config.json``."""

import argparse
import re
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_text
from dreamdrive.geometry.backends.dust3r.network.config import (
    NetworkConfig,
    check_agreement,
    config_from_call,
    config_from_json,
    config_from_shapes,
)
from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r
from dreamdrive.models import as_state, fill_network, read_state, read_torch

EXPECTED = (
    "a DUSt3R model: DUSt3R_ViTLarge_BaseDecoder_512_dpt.pth or the like, or the folder of its hub form "
    "with model.safetensors and config.json"
)
# In some checkpoints, never used: left from pre-training, or older names of parts that are there anyway.
_UNUSED = re.compile(
    r"prediction_head\.|enc_pos_embed$|dec_pos_embed$|downstream_head\d\.dpt\.act_[1-4]_postprocess\."
)


def load_dust3r(path: Path, *, bfloat16: bool = False) -> Dust3r:
    """Load a network from a ``.pth``; a ``.safetensors`` with ``config.json`` beside it; or their folder.

    Nothing in a file is executed. With ``bfloat16`` encoder and decoders compute in half the memory; the
    heads never do.

    Raises:
        InputError: A file is missing, damaged or unsafe, or it holds another model.
    """
    if path.is_dir():
        path = path / "model.safetensors"
    state, stated = _read_hub(path) if path.suffix == ".safetensors" else _read_pth(path)
    state = normalise(state, str(path))
    heads = None if stated is None else (stated.enc_heads, stated.dec_heads)
    found = config_from_shapes({key: tuple(value.shape) for key, value in state.items()}, str(path), heads)
    if stated is None:
        stated = found
    check_agreement(stated, found, str(path))
    # Nothing states the sizes of the DPT head.
    config = replace(stated, dpt=found.dpt)
    network = fill_network(lambda: Dust3r(config), state, str(path), EXPECTED)
    if bfloat16:
        network.lower_trunk()
    return network


def normalise(state: dict[str, Tensor], source: str) -> dict[str, Tensor]:
    """The state dict with the keys of ``Dust3r``, whichever of their variants a file has.

    The projections of the DPT head have two names each, of which a file may hold one.
    """
    state = {key.removeprefix("module."): value for key, value in state.items()}
    state = {key: value for key, value in state.items() if not _UNUSED.match(key)}
    if not any(key.startswith("dec_blocks2.") for key in state):
        # Pre-trained weights have one decoder, from which both start.
        own = [key for key in state if key.startswith("dec_blocks.")]
        state |= {key.replace("dec_blocks.", "dec_blocks2.", 1): state[key] for key in own}
    for head, layer in product((1, 2), range(4)):
        scratch = f"downstream_head{head}.dpt.scratch."
        names = (f"{scratch}layer{layer + 1}_rn.weight", f"{scratch}layer_rn.{layer}.weight")
        held = [state[name] for name in names if name in state]
        if len(held) == 2 and not torch.equal(*held):
            raise InputError(f"{source}: {names[0]} and {names[1]} are the same layer, but differ")
        if held:
            state |= dict.fromkeys(names, held[0])
    if "mask_token" not in state and "decoder_embed.bias" in state:
        state["mask_token"] = torch.zeros(1, 1, len(state["decoder_embed.bias"]))
    return state


def _read_pth(path: Path) -> tuple[dict[str, Tensor], NetworkConfig | None]:
    """Tensors, and the configuration if the file states one."""
    content: Any = read_torch(path, EXPECTED, [argparse.Namespace])
    if not isinstance(content, dict) or "model" not in content:
        return as_state(content, str(path), EXPECTED), None
    state = as_state(content["model"], str(path), EXPECTED)
    call = getattr(content.get("args"), "model", None)
    return state, None if call is None else config_from_call(str(call), str(path))


def _read_hub(path: Path) -> tuple[dict[str, Tensor], NetworkConfig]:
    beside = path.parent / "config.json"
    for needed in (path, beside):
        if not needed.is_file():
            raise InputError(f"{needed} does not exist or is no file; expected {EXPECTED}")
    config = config_from_json(read_text(beside), str(beside))
    return read_state(path, EXPECTED), config
