"""The sweep of ``one_frame`` in torch, for another device than the CPU; many frames are smoothed at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional

from dreamdrive.geometry.depth.one_frame import (
    MIN_PLANE_INVERSE,
    PLANE_BONUS,
    PLANE_MATCH,
    PLANE_MATCH_BONUS,
    Swept,
)
from dreamdrive.geometry.depth.smoothing import JUMP_COST, JUMP_LEVELS, STEP_COST
from dreamdrive.geometry.depth.sweep import (
    CENTRE,
    LABELS,
    MAX_INVERSE_DEPTH,
    MIN_Z,
    NOISE,
    UNSEEN_SCORE,
    WINDOW_PX,
    choose_sources,
)
from dreamdrive.geometry.depth.view import PosedFrames
from dreamdrive.scene.camera import Camera
from dreamdrive.vision.windows import window_px

_COST_BYTES = 2**28
"""Of the costs that are smoothed at once: each step of the smoothing waits for the one before."""
_UNSEEN = -2.0  # below every correlation
_CENTRES = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])  # from indices of pixels to their places


@dataclass(frozen=True)
class _Onto:
    """A source seen from a reference: at inverse depth w a pixel lands at ``matrix`` pixel + w ``shift``."""

    matrix: Float[Tensor, "3 3"]
    shift: Float[Tensor, "3"]
    grey: Float[Tensor, "h w"]
    usable: Bool[Tensor, "h w"]


@torch.no_grad()
def sweep_frames_on(
    view: PosedFrames, sky: Bool[np.ndarray, "f h w"], device: torch.device
) -> dict[int, Swept | None]:
    """As ``one_frame.sweep_frames`` on a device, with one copy to the CPU for each lot of frames."""
    grey, usable, plane, sky_there = (
        torch.from_numpy(maps).to(device) for maps in (view.grey, view.usable, view.plane_inverse, sky)
    )
    reach = view.options.depth.reach_frames
    chosen = {i: choose_sources(view.positions_m, view.used, i, reach) for i in view.frames}
    found: dict[int, Swept | None] = dict.fromkeys(view.frames)
    references = [i for i in view.frames if chosen[i]]
    lot = max(1, _COST_BYTES // (4 * LABELS * grey[0].numel()))
    for first in range(0, len(references), lot):
        some = references[first : first + lot]
        planes, costs, roads = plane[some], list[Tensor](), list[Tensor]()
        for i in some:
            onto = [_onto(view.cameras[i], view.cameras[j], grey[j], usable[j]) for j in chosen[i]]
            at = torch.linspace(0, MAX_INVERSE_DEPTH, LABELS, device=device)[:, None, None]
            costs.append(1 - _similarity(grey[i], onto, at, 0.5))
            roads.append(_similarity(grey[i], onto, plane[i][None], 0.0)[0])
        maps = _read(torch.stack(costs), grey[some], planes, torch.stack(roads), sky_there[some])
        for i, (inverse, correlation, on_plane) in zip(some, maps.cpu().numpy(), strict=True):
            found[i] = Swept(inverse, correlation, on_plane > 0)
            view.tell()
    for _ in range(len(found) - len(references)):
        view.tell()
    return found


def _onto(
    reference: Camera, source: Camera, grey: Float[Tensor, "h w"], usable: Bool[Tensor, "h w"]
) -> _Onto:
    relative = source.camera_from_world @ reference.world_from_camera
    there = np.linalg.inv(_CENTRES) @ source.matrix
    matrix = there @ relative[:3, :3] @ np.linalg.inv(reference.matrix) @ _CENTRES
    place = torch.from_numpy(np.column_stack([matrix, there @ relative[:3, 3]])).to(grey)
    return _Onto(place[:, :3], place[:, 3], grey, usable)


def _similarity(
    grey: Float[Tensor, "h w"], onto: Sequence[_Onto], inverse_depth: Float[Tensor, "n _ _"], rim_px: float
) -> Float[Tensor, "n h w"]:
    """Mean of the best two correlations over the sources, at inverse depths in 1/m.

    A source sees what lands at most ``rim_px`` outside of the centres of its outermost pixels.
    """
    side = window_px(WINDOW_PX, grey.shape[1])
    centred = grey - CENTRE
    mean = _box(centred[None], side)
    variance = (_box(centred[None] ** 2, side) - mean**2).clamp(min=0) + NOISE
    best = second = torch.full((), _UNSEEN, device=grey.device)
    for each in onto:
        warped, seen = _warped(each, inverse_depth, rim_px)
        other = warped - CENTRE
        about = _box(other, side)
        spread = (_box(other**2, side) - about**2).clamp(min=0) + NOISE
        score = (_box(centred * other, side) - mean * about) / torch.sqrt(spread * variance)
        score = torch.where(seen, score, _UNSEEN)
        second = torch.maximum(second, torch.minimum(best, score))
        best = torch.maximum(best, score)
    both = torch.where(second > _UNSEEN, (best + second) * 0.5, best)
    return torch.where(best > _UNSEEN, both, UNSEEN_SCORE)


def _warped(
    onto: _Onto, inverse_depth: Float[Tensor, "n _ _"], rim_px: float
) -> tuple[Float[Tensor, "n h w"], Bool[Tensor, "n h w"]]:
    """The source on the reference's pixels, edges repeated, and where it sees the point."""
    height, width = onto.grey.shape
    right, down = (torch.arange(n, dtype=torch.float32, device=onto.grey.device) for n in (width, height))
    x, y, z = (
        row[0] * right + (row[1] * down + row[2])[:, None] + shift * inverse_depth
        for row, shift in zip(onto.matrix.unbind(0), onto.shift.unbind(0), strict=True)
    )
    x, y = x / z, y / z
    seen = (
        (x >= -rim_px) & (x < width - 1 + rim_px) & (y >= -rim_px) & (y < height - 1 + rim_px) & (z > MIN_Z)
    )
    x, y = x.nan_to_num(0).clamp(0, width - 1), y.nan_to_num(0).clamp(0, height - 1)
    seen &= onto.usable[(y + 0.5).long(), (x + 0.5).long()]
    grid = torch.stack([x * (2 / (width - 1)) - 1, y * (2 / (height - 1)) - 1], dim=-1)
    picture = onto.grey[None, None].expand(len(grid), -1, -1, -1)
    return functional.grid_sample(picture, grid, padding_mode="border", align_corners=True)[:, 0], seen


def _box(maps: Float[Tensor, "n h w"], side: int) -> Float[Tensor, "n h w"]:
    """Means over a square window, which reaches over edges by reflection."""
    padded = functional.pad(maps[:, None], (side // 2,) * 4, mode="reflect")
    return functional.avg_pool2d(padded, side, stride=1)[:, 0]


def _read(
    cost: Float[Tensor, "f n h w"],
    grey: Float[Tensor, "f h w"],
    plane: Float[Tensor, "f h w"],
    road: Float[Tensor, "f h w"],
    sky: Bool[Tensor, "f h w"],
) -> Float[Tensor, "f 3 h w"]:
    """Inverse depth, correlation, and 1 where the road's plane won, after the smoothing."""
    step = MAX_INVERSE_DEPTH / (LABELS - 1)
    reachable = (plane > MIN_PLANE_INVERSE) & (plane <= MAX_INVERSE_DEPTH)
    plane_label = torch.round(plane / step).clamp(0, LABELS - 1).long()
    bonus = PLANE_BONUS + torch.where(road > PLANE_MATCH, PLANE_MATCH_BONUS * road, 0)
    favoured = cost.scatter_add(1, plane_label[:, None], -torch.where(reachable, bonus, 0)[:, None])
    favoured[:, 0] -= sky.float()
    label = best_labels(favoured, grey)
    whole = torch.round(label).long()
    score = 1 - cost.gather(1, whole[:, None])[:, 0]
    on_plane = reachable & (whole == plane_label)
    inverse = torch.where(on_plane, plane, label * step)
    correlation = torch.where(on_plane, torch.maximum(score, road), score)
    return torch.stack([inverse, correlation, on_plane.float()], dim=1)


def best_labels(cost: Float[Tensor, "f n h w"], grey: Float[Tensor, "f h w"]) -> Float[Tensor, "f h w"]:
    """As ``smoothing.best_label``, of many frames."""
    down, across = (JUMP_COST / (1 + grey.diff(dim=dim).abs() / JUMP_LEVELS) for dim in (1, 2))
    by_row, by_column = cost.permute(2, 0, 1, 3), cost.permute(3, 0, 1, 2)
    total = _both_ways(by_row, down.permute(1, 0, 2)).permute(1, 2, 0, 3)
    total = total + _both_ways(by_column, across.permute(2, 0, 1)).permute(1, 2, 3, 0)
    return _cheapest(total)


def _both_ways(cost: Float[Tensor, "s f n k"], jump: Float[Tensor, "t f k"]) -> Float[Tensor, "s f n k"]:
    """Least costs of paths that end at each place from either side, in sum."""
    jump = jump.clamp(min=STEP_COST)
    there_back = torch.cat([cost, cost.flip(0)], dim=1)
    jumps = torch.cat([jump, jump.flip(0)], dim=1)
    paths = [there_back[0]]
    for here, far in zip(there_back[1:], jumps, strict=True):
        path = paths[-1]
        least = path.amin(dim=1)
        walled = functional.pad(path, (0, 0, 1, 1), value=torch.inf)
        beside = torch.minimum(walled[:, :-2], walled[:, 2:]) + STEP_COST
        reached = torch.minimum(torch.minimum(path, (least + far)[:, None]), beside)
        paths.append(reached + here - least[:, None])
    forward, backward = torch.stack(paths).chunk(2, dim=1)
    return forward + backward.flip(0)


def _cheapest(total: Float[Tensor, "f n h w"]) -> Float[Tensor, "f h w"]:
    """The least of the labels, between its neighbours by the parabola through the three."""
    best = total.argmin(dim=1, keepdim=True)
    inner = best.clamp(1, total.shape[1] - 2)
    low, middle, high = (total.gather(1, inner + k)[:, 0] for k in (-1, 0, 1))
    best, curvature = best[:, 0], low - 2 * middle + high
    bent = (best == inner[:, 0]) & (curvature > 1e-6)
    shift = ((low - high) / (2 * torch.where(bent, curvature, 1))).clamp(-0.5, 0.5)
    return best + torch.where(bent, shift, 0)
