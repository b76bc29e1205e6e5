"""The camera of single pictures, and of all frames of a clip together."""

from collections.abc import Iterable
from dataclasses import replace
from math import exp

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.street.look import CameraEstimate
from dreamdrive.street_network.resize import ResizePad


def camera_of(answer: Float[np.ndarray, " 7"], resize: ResizePad) -> CameraEstimate:
    """The camera of a picture from ``Prediction.camera``, which is about what the network took."""
    focal, horizon, roll = answer[:3].tolist()
    spread = np.exp(answer[3:6]).tolist()
    # Shares of the width mean the same in the picture and in the network's.
    lifted = horizon * resize.across_px + resize.shift_px
    return CameraEstimate(
        width_px=resize.width_px,
        height_px=resize.height_px,
        focal_px=exp(focal) * resize.width_px,
        focal_spread=spread[0],
        horizon_px=lifted / resize.scale,
        horizon_spread_px=spread[1] * resize.width_px,
        roll_rad=roll,
        roll_spread_rad=spread[2],
        distorted=1 / (1 + exp(-float(answer[6]))),
    )


def common_camera(cameras: tuple[CameraEstimate, ...]) -> CameraEstimate:
    """The camera of a clip: medians over its frames, each by the inverse of its variance.

    Frames of one street err alike, so that many are no surer than one: spreads are medians too.
    """
    logs = np.log([each.focal_px for each in cameras])
    focal = _weights(each.focal_spread for each in cameras)
    horizon = _weights(each.horizon_spread_px for each in cameras)
    roll = _weights(each.roll_spread_rad for each in cameras)
    return replace(
        cameras[0],
        focal_px=exp(weighted_median(logs, focal)),
        focal_spread=_median([each.focal_spread for each in cameras]),
        horizon_px=weighted_median(np.array([each.horizon_px for each in cameras]), horizon),
        horizon_spread_px=_median([each.horizon_spread_px for each in cameras]),
        roll_rad=weighted_median(np.array([each.roll_rad for each in cameras]), roll),
        roll_spread_rad=_median([each.roll_spread_rad for each in cameras]),
        distorted=_median([each.distorted for each in cameras]),
    )


def weighted_median(values: Float[np.ndarray, " n"], weights: Float[np.ndarray, " n"]) -> float:
    """The value that has half of the weight on either side; between two the mean."""
    order = np.argsort(values)
    share = np.cumsum(weights[order]) / weights.sum()
    low, high = np.searchsorted(share, (0.5 - 1e-9, 0.5 + 1e-9))
    return float(values[order[[low, high]]].mean())


def _weights(spreads: Iterable[float]) -> Float[np.ndarray, " n"]:
    return np.array([1 / each**2 for each in spreads])


def _median(values: list[float]) -> float:
    return float(np.median(values))
