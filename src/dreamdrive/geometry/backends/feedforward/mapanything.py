"""MapAnything (Keetha et al. 2025) from the package ``mapanything`` 1.1, which is not on PyPI.

Signatures, names and conventions of outputs are those of facebookresearch/map-anything f7ebafb. The network
is built from the weights' ``config.json`` as its ``from_pretrained`` does, which however leaves at random
what the file lacks, and fetches weights of its encoder that the file replaces.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from dreamdrive.compute.device import chosen_device
from dreamdrive.errors import PIP, InputError
from dreamdrive.geometry.backends.feedforward.load import StoredWeights, build, read_stored, upstream
from dreamdrive.geometry.backends.feedforward.network import (
    METRE_SPREAD,
    FeedforwardResult,
    Network,
    Views,
    nearest_rigid,
    standardise,
)
from dreamdrive.geometry.backends.feedforward.reconstruct import FeedForward
from dreamdrive.geometry.protocol import GeometryBackend

EXPECTED = (
    "the hub's folder of a MapAnything model (config.json, model.safetensors), such as "
    "facebook/map-anything-apache"
)
INSTALL = (
    f"{PIP} --no-deps git+https://github.com/facebookresearch/map-anything uniception==0.1.7, then what "
    "its imports ask for; and git clone https://github.com/facebookresearch/dinov2 to torch hub's folder"
)
_NORMALISED = "dinov2"
_ENCODER = "facebookresearch_dinov2_main"


def load_mapanything(path: Path) -> Network:
    """Load the network, whose unit is the metre."""
    stored = read_stored(path, EXPECTED, needs_config=True)
    model = upstream("mapanything.models.mapanything", INSTALL)
    settings = _settings(stored)
    network = build(lambda: model.MapAnything(**settings), stored, stored.state)
    if network.encoder.data_norm_type != _NORMALISED:
        raise InputError(f"{stored.source} takes pictures standardised for {network.encoder.data_norm_type}")
    return Network(partial(_predict, network), "the metric network MapAnything", METRE_SPREAD)


def _settings(stored: StoredWeights) -> dict[str, Any]:
    """Arguments of the network, changed so that building it fetches nothing."""
    encoder = stored.config.get("encoder_config")
    if not isinstance(encoder, dict):
        raise InputError(f"config.json beside {stored.source} has no encoder_config; expected {EXPECTED}")
    if not encoder.get("uses_torch_hub"):
        return stored.config
    code = Path(torch.hub.get_dir()) / _ENCODER
    if not code.is_dir():
        raise InputError(
            f"the encoder of MapAnything takes its code from {code}, which is not there: "
            f"git clone https://github.com/facebookresearch/dinov2 {code}"
        )
    encoder = {**encoder, "torch_hub_pretrained": False}
    return {**stored.config, "encoder_config": encoder, "torch_hub_force_reload": False}


def _predict(network: Any, views: Views) -> FeedforwardResult:
    out = network.infer(_shown(views), use_amp=False, memory_efficient_inference=True, minibatch_size=1)

    def all_of(name: str) -> Tensor:
        return torch.cat([each[name] for each in out]).cpu()

    intrinsics = all_of("intrinsics").numpy().astype(np.float64)
    # It counts pixels from 0.
    intrinsics[:, :2, 2] += 0.5
    return FeedforwardResult(
        world_from_camera=nearest_rigid(all_of("camera_poses")),
        intrinsics=intrinsics,
        # Masked pixels are 0 already.
        depth=all_of("depth_z")[..., 0].numpy(),
        confidence=all_of("conf").numpy(),
    )


def _shown(views: Views) -> list[dict[str, Any]]:
    """One table a frame, with whatever is known of its camera."""
    known: dict[str, Tensor] = {}
    if views.camera is not None:
        matrix = views.camera.matrix
        matrix[:2, 2] -= 0.5
        known["intrinsics"] = torch.from_numpy(matrix).float()[None].to(chosen_device())
    shown = [
        {"img": picture[None].to(chosen_device()), "data_norm_type": [_NORMALISED], **known}
        for picture in standardise(views.pictures)
    ]
    if views.world_from_camera is not None:
        poses = torch.from_numpy(views.world_from_camera).float().to(chosen_device())
        metric = torch.tensor([views.metric], device=chosen_device())
        for table, pose in zip(shown, poses, strict=True):
            table |= {"camera_poses": pose[None], "is_metric_scale": metric}
    return shown


MAPANYTHING = GeometryBackend(
    name="mapanything",
    reconstruct=FeedForward("mapanything", load_mapanything, long_side_px=518),
    about="metric cameras and depth of 24 frames at a time (MapAnything); takes known cameras",
    licence="code Apache 2.0; weights map-anything-apache Apache 2.0, map-anything CC BY-NC 4.0",
    memory="weights of 2 to 5 GB, and several GB for 24 frames; in float32, on a GPU if torch has one",
    weights=EXPECTED,
    package="mapanything",
    install=INSTALL,
)
