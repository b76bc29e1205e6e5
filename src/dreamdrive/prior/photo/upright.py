"""Smoothing of a network's depth along upright surfaces, where it waves."""

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.scene.street.street_class import FLAT, StreetClass

_ALONG_PX, _ACROSS_PX = 60.0, 8.0
"""How far depth is averaged down a surface and across it, in a picture 480 wide."""
_STEP = 0.25
"""Change of the logarithm of depth that ends a surface."""
_ROUNDS = 3
_LEAST_PX = 6


def upright(
    depth: Float[np.ndarray, "h w"],
    regions: Int[np.ndarray, "h w"],
    stands: Bool[np.ndarray, "h w"],
) -> Float[np.ndarray, "h w"]:
    """Depth of what stands, averaged down and across within regions and up to its jumps.

    Edge-preserving smoothing by distances along rows and columns (Gastal and Oliveira 2011), of inverse
    depth; down more than across, as walls, trunks and cars stand on the road.
    """
    inverse = 1 / np.maximum(depth, 1e-3)
    log = np.log(inverse)
    scale = depth.shape[1] / 480
    ways: list[tuple[float, int, Float[np.ndarray, ...]]] = []
    for axis, reach in ((0, _ALONG_PX * scale), (1, _ACROSS_PX * scale)):
        far = 1 + reach / _STEP * np.abs(np.diff(log, axis=axis))
        same = (np.diff(regions, axis=axis) == 0) & _both(stands, axis)
        ways.append((reach, axis, np.where(same, far, np.inf)))
    smooth = inverse
    for round_ in range(_ROUNDS):
        share = np.sqrt(3) * 2 ** (_ROUNDS - round_ - 1) / np.sqrt(4**_ROUNDS - 1)
        for reach, axis, far in ways:
            smooth = _averaged(smooth, np.exp(-np.sqrt(2) / (reach * share) * far), axis)
    return np.where(stands, 1 / np.maximum(smooth, 1e-6), depth)


def _both(mask: Bool[np.ndarray, "h w"], axis: int) -> Bool[np.ndarray, "..."]:
    return mask[1:] & mask[:-1] if axis == 0 else mask[:, 1:] & mask[:, :-1]


def _averaged(
    values: Float[np.ndarray, "h w"], weight: Float[np.ndarray, "..."], axis: int
) -> Float[np.ndarray, "h w"]:
    """Each value drawn to the one before it by a weight, there and back."""
    out, weight = np.moveaxis(values, axis, 0).copy(), np.moveaxis(weight, axis, 0)
    for i in range(1, len(out)):
        out[i] += weight[i - 1] * (out[i - 1] - out[i])
    for i in range(len(out) - 2, -1, -1):
        out[i] += weight[i] * (out[i + 1] - out[i])
    return np.moveaxis(out, 0, axis)


def poles_stand(
    depth: Float[np.ndarray, "h w"], classes: UInt8[np.ndarray, "h w"], plane: Float[np.ndarray, "h w"]
) -> None:
    """Each pole at one depth: of its foot on the road, else of most of it."""
    pole = (classes == StreetClass.POLE).astype(np.uint8)
    count, parts = cv2.connectedComponents(pole)
    for part in range(1, count):
        here = parts == part
        rows = np.flatnonzero(here.any(1))
        if here.sum() < _LEAST_PX:
            continue
        middle = float(np.median(depth[here]))
        below = min(rows[-1] + 1, len(depth) - 1)
        foot = here[rows[-1]]
        on_ground = np.isin(classes[below, foot], FLAT)
        at = float(np.median(plane[rows[-1], foot]))
        stands = on_ground.mean() > 0.5 and 0.5 < at / middle < 2.0
        depth[here] = at if stands else middle
