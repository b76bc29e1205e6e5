"""Rigid motion of actors: key frames of translation and yaw, and the curve through them."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor


@dataclass(frozen=True)
class Tracks:
    """Rigid motion of the actors: key frames to start from, refined by the fit.

    Attributes:
        times_s: Times of the key frames (T,), strictly increasing.
        translation_m: Offset of each actor from its canonical place (A, T, 3).
        yaw_rad: Rotation about the up axis from the canonical attitude (A, T), right-handed.
        pivot_m: Point each actor turns about (A, 3), in the world, in its canonical place.
    """

    times_s: Float[np.ndarray, " t"]
    translation_m: Float[np.ndarray, "a t 3"]
    yaw_rad: Float[np.ndarray, "a t"]
    pivot_m: Float[np.ndarray, "a 3"]

    def __post_init__(self) -> None:
        if len(self.times_s) == 0 or len(self.pivot_m) == 0 or (np.diff(self.times_s) <= 0).any():
            raise ValueError("tracks: expected at least one actor and strictly increasing key times")


def multiply_quaternions(a: Float[Tensor, "*n 4"], b: Float[Tensor, "*n 4"]) -> Float[Tensor, "*n 4"]:
    """Hamilton product of wxyz quaternions: the rotation b, then a."""
    aw, ax, ay, az = a.unbind(-1)
    bw, bx, by, bz = b.unbind(-1)
    return torch.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        dim=-1,
    )


def key_weights(times: list[float], t_s: float) -> list[float]:
    """What each key frame contributes at ``t_s``: a spline is linear in its key frames."""
    if len(times) < 2:
        return [1.0] * len(times)
    i = min(max(int(np.searchsorted(times, t_s, side="right")) - 1, 0), len(times) - 2)
    step = times[i + 1] - times[i]
    u = (t_s - times[i]) / step
    start, end = np.eye(len(times))[i : i + 2]
    slope, next_slope = (_slope_weights(times, k) * step for k in (i, i + 1))
    if u < 0:
        at = start + u * slope
    elif u > 1:
        at = end + (u - 1) * next_slope
    else:
        bend = 2 * (start - end) + slope + next_slope
        at = start + u * (slope + u * (end - start - slope - bend + u * bend))
    return at.tolist()


def _slope_weights(times: list[float], k: int) -> Float[np.ndarray, " t"]:
    """Velocity at key frame ``k``, of the parabola through it and its neighbours; one-sided at the ends."""
    keys = np.eye(len(times))
    before, after = min(k, len(times) - 2), max(k, 1)
    ahead = (keys[before + 1] - keys[before]) / (times[before + 1] - times[before])
    behind = (keys[after] - keys[after - 1]) / (times[after] - times[after - 1])
    share = (times[after] - times[after - 1]) / (times[before + 1] - times[after - 1])
    return behind + share * (ahead - behind)


def rotate(vectors: Tensor, axis: Tensor, angle_rad: Tensor) -> Tensor:
    """Rodrigues' formula: vectors (N, 3) about one unit axis (3,) by (N,) angles."""
    cosine, sine = angle_rad.cos()[:, None], angle_rad.sin()[:, None]
    along = (vectors @ axis)[:, None] * axis
    return along + (vectors - along) * cosine + torch.linalg.cross(axis.expand_as(vectors), vectors) * sine
