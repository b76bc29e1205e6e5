"""Scores of the network on pictures that it was not trained on."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.street_network.network import StreetNetwork
from dreamdrive.street_network.prediction import Prediction
from dreamdrive_train.street_network.data.mixture import Entry
from dreamdrive_train.street_network.data.picture import centred, read_entry
from dreamdrive_train.street_network.targets import Batch, batch_of

SIZE_PX = (384, 224)
"""Of what is judged, cut from the middle."""
_CLASSES = len(StreetClass)


def judge(network: StreetNetwork, entries: Sequence[Entry]) -> dict[str, float]:
    """Figures of a network over records; those of which nothing is known are left out.

    - ``iou/NAME``, ``miou``: intersection over union over all pixels whose label is one class;
    - ``depth_rel``: mean over pictures of the mean error of depth as a share of it, after the median is
      aligned; ``depth_rel_in_heights`` the same without alignment;
    - ``focal``: median error of the logarithm of the focal length; ``horizon``: of the horizon in picture
      widths; ``roll_deg``: of the roll;
    - ``records``: how many were judged.
    """
    folded = network.folded()
    device = next(folded.parameters()).device
    confusion = torch.zeros(_CLASSES, _CLASSES, dtype=torch.int64)
    found: dict[str, list[float]] = {}
    with torch.inference_mode():
        for entry in entries:
            batch = batch_of([centred(read_entry(entry), SIZE_PX)], [False], [])
            said = folded(batch.pictures.to(device).float() / 255)
            confusion += _confusion(said.classes.argmax(dim=1).cpu(), batch.labels)
            for name, value in _errors(said, batch).items():
                found.setdefault(name, []).append(value)
    means = ("depth_rel", "depth_rel_in_heights")
    figures = {
        name: float((np.mean if name in means else np.median)(values)) for name, values in found.items()
    }
    return figures | _ious(confusion) | {"records": float(len(entries))}


def _confusion(said: Tensor, labels: Tensor) -> Tensor:
    """Pixels by label and answer; labels that are sets of classes are left out."""
    sure = labels < _CLASSES
    both = labels[sure].long() * _CLASSES + said[sure]
    return torch.bincount(both, minlength=_CLASSES**2).view(_CLASSES, _CLASSES)


def _ious(confusion: Tensor) -> dict[str, float]:
    same = confusion.diag()
    union = confusion.sum(dim=0) + confusion.sum(dim=1) - same
    there = [each for each in StreetClass if confusion[each].sum()]
    ious = {f"iou/{each.name.lower()}": float(same[each] / union[each]) for each in there}
    return ious | ({"miou": float(np.mean(list(ious.values())))} if ious else {})


def _errors(said: Prediction, batch: Batch) -> dict[str, float]:
    """Of the depth and the camera of one picture."""
    found: dict[str, float] = {}
    known = (batch.depth_m > 0) & torch.isfinite(batch.depth_m)
    if known.any():
        ratio = said.log_depth.cpu()[known] - batch.depth_m[known].log()
        found["depth_rel"] = _relative(ratio - ratio.median())
        height = float(batch.camera_height_m)
        if np.isfinite(height):
            found["depth_rel_in_heights"] = _relative(ratio + np.log(height))
    error = (said.camera[0, :3].cpu() - batch.camera[0]).abs()
    for name, value in zip(("focal", "horizon", "roll_deg"), error.tolist(), strict=True):
        if np.isfinite(value):
            found[name] = float(np.rad2deg(value)) if name == "roll_deg" else value
    return found


def _relative(log_ratio: Float[Tensor, " n"]) -> float:
    return float((log_ratio.exp() - 1).abs().mean())
