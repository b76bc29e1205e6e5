"""Colour that depends on the direction: real spherical harmonics, in the order and signs of 3DGS."""

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor


def sh_basis(directions: Float[Tensor, "n 3"], degree: int) -> Float[Tensor, "n k"]:
    """Real spherical harmonics up to ``degree`` (0 to 3) at unit directions; order and signs of 3DGS."""
    x, y, z = directions.unbind(-1)
    basis = [torch.full_like(x, 0.28209479177387814)]
    if degree >= 1:
        basis += [-0.4886025119029199 * y, 0.4886025119029199 * z, -0.4886025119029199 * x]
    if degree >= 2:
        basis += [
            1.0925484305920792 * x * y,
            -1.0925484305920792 * y * z,
            0.31539156525252005 * (2 * z * z - x * x - y * y),
            -1.0925484305920792 * x * z,
            0.5462742152960396 * (x * x - y * y),
        ]
    if degree >= 3:
        basis += [
            -0.5900435899266435 * y * (3 * x * x - y * y),
            2.890611442640554 * x * y * z,
            -0.4570457994644658 * y * (4 * z * z - x * x - y * y),
            0.3731763325901154 * z * (2 * z * z - 3 * x * x - 3 * y * y),
            -0.4570457994644658 * x * (4 * z * z - x * x - y * y),
            1.445305721320277 * z * (x * x - y * y),
            -0.5900435899266435 * x * (x * x - 3 * y * y),
        ]
    return torch.stack(basis, -1)


def sh_rotation(rotation: Float[np.ndarray, "3 3"], degree: int) -> Float[np.ndarray, "k k"]:
    """The matrix M (K, K) that turns colours: coefficients M c have at R d the colour that c have at d.

    Harmonics of one degree stay among themselves, and enough directions tell how.
    """
    directions = np.random.default_rng(0).normal(size=(64, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    here, there = (
        sh_basis(torch.from_numpy(each), degree).numpy() for each in (directions, directions @ rotation.T)
    )
    turned = np.zeros((here.shape[1], here.shape[1]))
    for band in range(degree + 1):
        own = slice(band * band, (band + 1) ** 2)
        turned[own, own] = np.linalg.lstsq(there[:, own], here[:, own], rcond=None)[0]
    return np.where(np.abs(turned) < 1e-12, 0.0, turned)
