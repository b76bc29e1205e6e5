"""Depth Anything 3 (Lin et al. 2025) from the PyPI package ``depth-anything-3`` 0.1.1.

Only its network is used, which takes a fraction of the package's dependencies; its own door
(``depth_anything_3.api``) imports all of them. Signatures and names of outputs are those of that release.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from torch import nn

from dreamdrive.compute.device import chosen_device
from dreamdrive.errors import PIP, InputError
from dreamdrive.geometry.backends.feedforward.load import StoredWeights, build, read_stored, upstream
from dreamdrive.geometry.backends.feedforward.network import (
    METRE_SPREAD,
    FeedforwardResult,
    Network,
    Views,
    standardise,
    world_from_camera,
)
from dreamdrive.geometry.backends.feedforward.reconstruct import FeedForward
from dreamdrive.geometry.protocol import GeometryBackend

EXPECTED = (
    "the hub's folder of a Depth Anything 3 model (config.json, model.safetensors), such as "
    "depth-anything/DA3-BASE"
)
INSTALL = (
    f"{PIP} --no-deps depth-anything-3==0.1.1, then {PIP} addict einops omegaconf "
    "(without --no-deps it replaces numpy and torch)"
)
_METRIC = ("da3nested-giant-large",)
_RELATIVE = ("da3-small", "da3-base", "da3-large", "da3-giant")
_ONE_PICTURE = ("da3mono-large", "da3metric-large")
_GAUSSIANS = ("gs_head", "gs_adapter")


def load_da3(path: Path) -> Network:
    """Load a network with poses; the one with ``nested`` in its name has the metre as its unit."""
    stored = read_stored(path, EXPECTED, needs_config=True)
    name = _model_name(stored)
    config = upstream("depth_anything_3.cfg", INSTALL)
    state = stored.keep("model.", tuple(f"{part}{each}." for part in ("", "da3.") for each in _GAUSSIANS))
    network = build(lambda: _make(config, name), stored, state)
    if name not in _METRIC:
        return Network(partial(_predict, network))
    return Network(partial(_predict, network), f"the metric network {name}", METRE_SPREAD)


def _model_name(stored: StoredWeights) -> str:
    name = str(stored.config.get("model_name"))
    if name in _ONE_PICTURE:
        raise InputError(
            f"{stored.source} is {name}, which sees one picture at a time and gives no cameras; "
            f"take one of {', '.join(_RELATIVE + _METRIC)}"
        )
    if name not in _RELATIVE + _METRIC:
        raise InputError(
            f"config.json beside {stored.source} names the model {name}, not one of "
            f"{', '.join(_RELATIVE + _METRIC)}; expected {EXPECTED}"
        )
    return name


def _make(config: Any, name: str) -> nn.Module:
    """The network by the package's own description, without the heads for Gaussians, which are not used."""
    described = config.load_config(f"depth_anything_3.configs.{name}")
    for part in (described, described.get("anyview", {})):
        for head in _GAUSSIANS:
            part.pop(head, None)
    return config.create_object(described)


def _predict(network: nn.Module, views: Views) -> FeedforwardResult:
    out = network(standardise(views.pictures).to(chosen_device())[None])
    return FeedforwardResult(
        world_from_camera=world_from_camera(out["extrinsics"][0]),
        intrinsics=out["intrinsics"][0].cpu().numpy().astype(np.float64),
        depth=out["depth"][0].cpu().numpy(),
        confidence=out["depth_conf"][0].cpu().numpy(),
    )


DA3 = GeometryBackend(
    name="da3",
    reconstruct=FeedForward("da3", load_da3, long_side_px=504),
    about="cameras and depth of 24 frames at a time (Depth Anything 3); metric with the nested model",
    licence=(
        "code Apache 2.0; weights SMALL and BASE Apache 2.0, LARGE, GIANT and NESTED CC BY-NC 4.0: "
        "not for commercial use"
    ),
    memory=(
        "weights of 0.14 GB (SMALL) to 6 GB (NESTED), and some GB for 24 frames; in float32, on a GPU if "
        "torch has one"
    ),
    weights=EXPECTED,
    package="depth_anything_3",
    install=INSTALL,
)
