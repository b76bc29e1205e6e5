"""Gaussians for the formats, and what two programs must agree on."""

import numpy as np
import torch
from jaxtyping import Float

from dreamdrive.data.splats.splats import UP_AND_BACK
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.harmonics import sh_basis
from dreamdrive.splat.reference import rotation_matrices


def some(count: int = 50, coefficients: int = 16, seed: int = 0) -> Gaussians:
    """Gaussians as of a street: within 100 m, millimetres to metres large, colours within bounds."""
    g = torch.Generator().manual_seed(seed)
    return Gaussians(
        means=20 * torch.randn(count, 3, generator=g),
        quaternions=torch.randn(count, 4, generator=g),
        log_scales=torch.empty(count, 3).uniform_(-5, 1, generator=g),
        logit_opacities=2 * torch.randn(count, generator=g),
        sh=torch.empty(count, coefficients, 3).uniform_(-0.9, 0.9, generator=g),
        source_frame=torch.zeros(count, dtype=torch.int64),
    )


def covariances(gaussians: Gaussians) -> Float[np.ndarray, "n 3 3"]:
    """In square metres; what rotations and scales mean together."""
    axes = rotation_matrices(gaussians.quaternions) * torch.exp(gaussians.log_scales)[:, None]
    return (axes @ axes.transpose(1, 2)).numpy()


def colours(gaussians: Gaussians, direction: Float[np.ndarray, "3"]) -> Float[np.ndarray, "n 3"]:
    """As seen along a direction."""
    along = torch.tensor(direction / np.linalg.norm(direction), dtype=torch.float32)[None]
    basis = sh_basis(along, gaussians.sh_degree)[0]
    return torch.einsum("k,nkc->nc", basis, gaussians.sh).numpy()


def check_same(
    found: Gaussians, true: Gaussians, *, place_m: float, size: float, opacity: float, colour: float
) -> None:
    """That two sets are the same ones in the same axes, within the precision of a format.

    ``size`` is that of the covariance, as part of its largest entry.
    """
    assert (found.means - true.means).abs().max() <= place_m
    here, there = covariances(found), covariances(true)
    assert (np.abs(here - there).max(axis=(1, 2)) / there.max(axis=(1, 2))).max() <= size
    shown = [torch.sigmoid(each.logit_opacities) for each in (found, true)]
    assert (shown[0] - shown[1]).abs().max() <= opacity
    for direction in np.random.default_rng(0).normal(size=(5, 3)):
        assert np.abs(colours(found, direction) - colours(true, direction)).max() <= colour


def up_and_back(numbers: dict[str, np.ndarray]) -> Gaussians:
    """What another program read in axes x right, y up, z back, as ours, without our code for turning.

    ``numbers`` has means, wxyz quaternions, log_scales, logit_opacities and sh. A half turn about x is the
    product with (0, 1, 0, 0); harmonics keep their places and change signs with y and z.
    """
    directions = torch.nn.functional.normalize(torch.randn(16, 3, dtype=torch.float64), dim=1)
    sh = numbers["sh"]
    degree = int(np.sqrt(sh.shape[1])) - 1
    here = sh_basis(directions, degree)
    there = sh_basis(directions @ torch.from_numpy(UP_AND_BACK), degree)
    signs = torch.sign((here * there).sum(dim=0)).numpy()
    assert np.allclose(there.numpy(), here.numpy() * signs)
    w, x, y, z = numbers["quaternions"].T
    return Gaussians(
        means=torch.tensor(numbers["means"] * [1, -1, -1], dtype=torch.float32),
        quaternions=torch.tensor(np.stack([-x, w, -z, y], axis=1), dtype=torch.float32),
        log_scales=torch.tensor(numbers["log_scales"], dtype=torch.float32),
        logit_opacities=torch.tensor(numbers["logit_opacities"], dtype=torch.float32),
        sh=torch.tensor(sh * signs[:, None], dtype=torch.float32),
        source_frame=torch.zeros(len(sh), dtype=torch.int64),
    )
