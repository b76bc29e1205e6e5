"""VGGT (Wang et al., CVPR 2025) from the package ``vggt``, which is not on PyPI.

Names of outputs and the convention of poses are those of its README (facebookresearch/vggt 2494ff7) and of
the copy of its code in facebookresearch/map-anything f7ebafb; ``enable_point`` and ``enable_track``, which
that copy lacks, are read from forks of its present release.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from torch import nn

from dreamdrive.compute.device import chosen_device
from dreamdrive.errors import PIP
from dreamdrive.geometry.backends.feedforward.load import build, read_stored, upstream
from dreamdrive.geometry.backends.feedforward.network import (
    FeedforwardResult,
    Network,
    Views,
    world_from_camera,
)
from dreamdrive.geometry.backends.feedforward.reconstruct import FeedForward
from dreamdrive.geometry.protocol import GeometryBackend

EXPECTED = "VGGT's model.safetensors or model.pt or their folder, such as facebook/VGGT-1B"
INSTALL = f"{PIP} --no-deps git+https://github.com/facebookresearch/vggt, then {PIP} einops"
_SIZES = ("img_size", "patch_size", "embed_dim")
_UNUSED = ("point_head.", "track_head.")


def load_vggt(path: Path) -> Network:
    """Load the network without the heads for points and tracks, which are not used."""
    stored = read_stored(path, EXPECTED)
    model, encoding = (upstream(f"vggt.{name}", INSTALL) for name in ("models.vggt", "utils.pose_enc"))
    sizes = {name: stored.config[name] for name in _SIZES if name in stored.config}
    network = build(
        lambda: model.VGGT(**sizes, enable_point=False, enable_track=False),
        stored,
        stored.keep(without=_UNUSED),
    )
    return Network(partial(_predict, network, encoding))


def _predict(network: nn.Module, encoding: Any, views: Views) -> FeedforwardResult:
    out = network(views.pictures.to(chosen_device())[None])
    size = tuple(views.pictures.shape[-2:])
    camera_from_world, intrinsics = encoding.pose_encoding_to_extri_intri(out["pose_enc"], size)
    return FeedforwardResult(
        world_from_camera=world_from_camera(camera_from_world[0]),
        intrinsics=intrinsics[0].cpu().numpy().astype(np.float64),
        depth=out["depth"][0, ..., 0].cpu().numpy(),
        confidence=out["depth_conf"][0].cpu().numpy(),
    )


VGGT = GeometryBackend(
    name="vggt",
    reconstruct=FeedForward("vggt", load_vggt, long_side_px=518),
    about="cameras and depth of 24 frames at a time (VGGT)",
    licence=(
        "code VGGT License (own terms, commercial use allowed); weights VGGT-1B not for commercial use, "
        "VGGT-1B-Commercial on request"
    ),
    memory=(
        "weights of 5 GB; its authors state 4 GB for 10 frames and 11 GB for 50 in half precision; here in "
        "float32, on a GPU if torch has one"
    ),
    weights=EXPECTED,
    package="vggt",
    install=INSTALL,
)
