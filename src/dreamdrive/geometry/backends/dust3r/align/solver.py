"""Levenberg-Marquardt over cameras and pairs, depth eliminated (variable projection)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.sparse import csr_array
from torch import Tensor

from dreamdrive.geometry.backends.dust3r.align.normal import ImageSamples, normal_equations
from dreamdrive.geometry.backends.dust3r.align.rays import Penalty
from dreamdrive.geometry.backends.dust3r.align.state import PER_EDGE, PER_IMAGE, Freedom, State

_DAMPING = 1e-4
_LESS, _MORE, _MOST = 0.3, 8.0, 1e6
_DEPTH_STEPS = 3
_BEND = 0.5  # see normal_equations


@dataclass(frozen=True)
class _Point:
    state: State
    depth: list[Tensor]
    loss: float


def solve(
    samples: Sequence[ImageSamples],
    state: State,
    penalty: Penalty,
    freedom: Freedom,
    *,
    steps: int = 60,
    tolerance: float = 5e-5,
) -> tuple[State, tuple[float, ...]]:
    """Lower the loss over the samples until a step gains less than ``tolerance`` of it.

    Each step solves the depth of every sampled pixel along its ray, then for cameras and pairs the damped
    normal equations in which those depths follow along. A step that does not lower the loss is taken back.
    The state comes back, and the losses before each step and at the end.
    """
    depth = [each.misses(state).middle() for each in samples]
    here = _at(samples, state, depth, penalty, 2 * _DEPTH_STEPS)
    losses, damping = [here.loss], _DAMPING
    for _ in range(steps):
        basis = freedom.basis(here.state)
        hessian, gradient = _equations(samples, here, penalty, basis)
        there: _Point | None = None
        while there is None and damping < _MOST:
            unknowns = _damped(hessian, gradient, damping)
            if unknowns is not None:
                there = _at(samples, here.state.moved(-(basis @ unknowns)), here.depth, penalty, _DEPTH_STEPS)
            if there is None or not there.loss <= here.loss:
                there, damping = None, damping * _MORE
        damping *= _LESS
        if there is None:
            break
        slow = there.loss > (1 - tolerance) * here.loss
        here = _at(samples, there.state, there.depth, penalty, 1)
        losses.append(here.loss)
        if slow:
            break
    return here.state, tuple(losses)


def _at(
    samples: Sequence[ImageSamples], state: State, depth: list[Tensor], penalty: Penalty, steps: int
) -> _Point:
    """The loss at a state, the depths brought on from given ones, by which a relative cost measures."""
    loss, found = 0.0, list[Tensor]()
    for each, before in zip(samples, depth, strict=True):
        misses = each.misses(state)
        after = misses.depth(before, penalty, before, steps)
        loss += float(misses.cost(after, penalty, before)[0].sum())
        found.append(after)
    return _Point(state, found, loss)


def _equations(
    samples: Sequence[ImageSamples], here: _Point, penalty: Penalty, basis: csr_array
) -> tuple[np.ndarray, np.ndarray]:
    images = PER_IMAGE * len(here.state.centre)
    size = images + PER_EDGE * len(here.state.edge_scale)
    hessian, gradient = np.zeros((size, size)), np.zeros(size)
    for each, depth in zip(samples, here.depth, strict=True):
        own_hessian, own_gradient = normal_equations(each, here.state, depth, penalty, _BEND)
        starts = [PER_IMAGE * each.image, *(images + PER_EDGE * edge for edge in each.edges)]
        at = np.concatenate([np.arange(start, start + 7) for start in starts])
        hessian[np.ix_(at, at)] += own_hessian.numpy()
        gradient[at] += own_gradient.numpy()
    return basis.T @ (basis.T @ hessian).T, basis.T @ gradient


def _damped(
    hessian: Float[np.ndarray, "u u"], gradient: Float[np.ndarray, " u"], damping: float
) -> Float[np.ndarray, " u"] | None:
    diagonal = torch.from_numpy(np.diagonal(hessian).copy())
    damped = torch.from_numpy(hessian) + torch.diag(damping * diagonal + 1e-12 * diagonal.max())
    factor, failed = torch.linalg.cholesky_ex(damped)
    if failed:
        return None
    return torch.cholesky_solve(torch.from_numpy(gradient)[:, None], factor)[:, 0].numpy()
