"""The labels and answers of the golden numbers of losses and figures."""

import numpy as np
import torch
from torch import Tensor

from dreamdrive.tasks.perception import LAYERS, BevTruth
from dreamdrive.tasks.perception.raster import ROAD, VEHICLES
from tests.golden.reading import arrays, tensors

NUMBERS = "eval/cvt_loss_metric.npz"


def layers() -> Tensor:
    """All twelve (b, 12, rows, columns)."""
    given = arrays(NUMBERS)
    b, rows, columns = given["visibility"].shape
    bits = np.unpackbits(given["bev"], axis=-1)[:, : len(LAYERS) * rows * columns]
    return torch.from_numpy(bits.reshape(b, len(LAYERS), rows, columns))


def truth() -> BevTruth:
    given, every = tensors(NUMBERS), layers()
    return BevTruth(
        vehicle=every[:, list(VEHICLES)].amax(dim=1),
        centre=given["center"][:, 0],
        visibility=given["visibility"],
        road=every[:, list(ROAD)].amax(dim=1),
    )


def logits(name: str) -> Tensor:
    return tensors(NUMBERS)[name][:, 0].clone().requires_grad_()
