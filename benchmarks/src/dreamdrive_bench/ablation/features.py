"""Other features for F_score: some of its own, or those of a network that has seen a million photos."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import torch

from dreamdrive.evaluate.networks import efficientnet_lite
from dreamdrive.fit import initialise
from dreamdrive.options import Options
from dreamdrive.prior import pca
from dreamdrive.scene.clip import OF_GEOMETRY
from dreamdrive.scene.gaussians import Gaussians

_BLOCK = 4  # the last one of stride 8: 40 channels
Before = Mapping[str, Any]
"""Results of the stages before, by name."""
Usual = Callable[[], Gaussians]


def with_evidence(before: Before, options: Options, usual: Usual) -> Gaussians:
    """Z_ref is the evidence of geometry alone."""
    return _seeing(usual(), slice(0, OF_GEOMETRY))


def with_appearance(before: Before, options: Options, usual: Usual) -> Gaussians:
    """Z_ref is the appearance alone."""
    return _seeing(usual(), slice(OF_GEOMETRY, None))


def without_features(before: Before, options: Options, usual: Usual) -> Gaussians:
    """No Z_ref."""
    return _seeing(usual(), slice(0, 0))


def with_efficientnet(before: Before, options: Options, usual: Usual) -> Gaussians:
    """Z_ref is the evidence and 16 components of EfficientNet-Lite0's features."""
    usual()  # the static fit that all variants share follows from it
    clip = before["prior"]
    features = pca.reduce(list(_features(efficientnet_lite.load_efficientnet_lite0(), clip.frames)))
    return initialise(replace(clip, features={"efficientnet": features}), before["geometry"], options.seeds)


def _seeing(seeds: Gaussians, channels: slice) -> Gaussians:
    assert seeds.features is not None
    seen = torch.zeros_like(seeds.features)
    seen[:, channels] = seeds.features[:, channels]
    return replace(seeds, features=seen)


@torch.inference_mode()
def _features(network: efficientnet_lite.EfficientNetLite0, frames: np.ndarray) -> np.ndarray:
    kept: list[np.ndarray] = []
    hook = network._blocks[_BLOCK].register_forward_hook(
        lambda module, given, made: kept.append(made[0].permute(1, 2, 0).numpy())
    )
    for frame in torch.from_numpy(frames):
        network((frame.permute(2, 0, 1)[None].float() - 127) / 128)
    hook.remove()
    return np.stack(kept)
