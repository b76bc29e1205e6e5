"""Other features for F_score: those of a network that has seen a million photos."""

from dataclasses import replace

import numpy as np
import torch

from dreamdrive.evaluate.networks.efficientnet_lite import EfficientNetLite0, load_efficientnet_lite0
from dreamdrive.fit import initialise
from dreamdrive.options import Quality
from dreamdrive.prior.pca import reduce
from street.case import Start

_BLOCK = 4  # the last one of stride 8: 40 channels


def with_efficientnet(begin: Start, quality: Quality) -> Start:
    """The same start, with 16 components of EfficientNet-Lite0's features as Z_ref."""
    features = reduce(list(_features(load_efficientnet_lite0(), begin.clip.frames)))
    clip = replace(begin.clip, features={"efficientnet": features})
    return replace(begin, clip=clip, seeds=initialise(clip, begin.geometry, quality.seeds))


@torch.inference_mode()
def _features(network: EfficientNetLite0, frames: np.ndarray) -> np.ndarray:
    kept: list[np.ndarray] = []
    hook = network._blocks[_BLOCK].register_forward_hook(
        lambda module, given, made: kept.append(made[0].permute(1, 2, 0).numpy())
    )
    for frame in torch.from_numpy(frames):
        network((frame.permute(2, 0, 1)[None].float() - 127) / 128)
    hook.remove()
    return np.stack(kept)
