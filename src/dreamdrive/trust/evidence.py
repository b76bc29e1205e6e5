"""What the recorded views tell of each Gaussian: how often it was seen, from where, how well it fitted."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import SceneView, moment_of, render_scene, shares
from dreamdrive.vision.residual import BLOCK_PX

MOST_VIEWS = 16
"""Recorded views that are asked, evenly among those that the fit has seen."""
_SEES = 0.1
"""Of what a Gaussian adds to the view that shows most of it: a view that shows less does not see it."""
_LEAST_PX = 1e-3
_UNSEEN_PX = 0.5
"""What all recorded views together show of a Gaussian that hardly was seen."""
_FARTHEST_RAD, _FIRM_RAD = 1.5, 0.01
_MOST_RATIO, _MOST_CLOSER = 30.0, 10.0
CHANNELS = 5


@dataclass(frozen=True)
class GaussianEvidence:
    """Of each Gaussian (N,), the static ones first, in each of the views asked (V,).

    Attributes:
        weight_px: What it adds to all of them, in pixels (N,).
        error: Mean squared error of the recorded frames where it shows (N,).
        sees: Which views see it (N, V).
        directions: Unit vectors from it to their cameras (N, V, 3), in its own axes where it moves.
        nearest_m: Distance of the nearest camera that sees it (N,).
        spread_rad: Deviation of the directions from which it was seen (N,).
    """

    weight_px: Float[Tensor, " n"]
    error: Float[Tensor, " n"]
    sees: Bool[Tensor, "n v"]
    directions: Float[Tensor, "n v 3"]
    nearest_m: Float[Tensor, " n"]
    spread_rad: Float[Tensor, " n"]

    def error_and_unseen(self, rows: Int[Tensor, " m"]) -> tuple[Float[Tensor, " m"], Float[Tensor, " m"]]:
        """Root of the squared error of some, and how little they were seen, 0 to 1, where the rows are."""
        error, weight_px = (each.to(rows.device)[rows] for each in (self.error, self.weight_px))
        return error.sqrt(), torch.exp(-weight_px / _UNSEEN_PX)


def asked_views(scene: Scene, most: int) -> list[int]:
    """Views that the fit has seen, evenly in time of each camera of the rig."""
    used = np.flatnonzero(~scene.held_out)
    if scene.camera is not None:
        used = used[np.argsort(scene.camera[used], kind="stable")]
    chosen = np.linspace(0, len(used) - 1, min(most, len(used))).round().astype(int)
    return [int(view) for view in used[chosen]]


@one_torch_thread()
def evidence_of(scene: Scene, squared_error: Float[np.ndarray, "f bh bw"]) -> GaussianEvidence:
    """Look at the recorded views again; ``squared_error`` is theirs, of each block of ``BLOCK_PX`` pixels."""
    views = asked_views(scene, MOST_VIEWS)
    count, asked = len(scene.static) + len(scene.dynamic), len(views)
    weight, error = torch.zeros(count, asked), torch.zeros(count)
    directions, away_m = torch.zeros(count, asked, 3), torch.full((count, asked), torch.inf)
    for k, view in enumerate(views):
        camera, t_s = scene.cameras[view], float(scene.times_s[view])
        gaussians, is_dynamic = moment_of(scene, t_s)
        rows = rows_at(scene, t_s)
        shown, off = _shares(gaussians, camera, squared_error[view])
        weight[rows, k] = shown
        error[rows] += off
        directions[rows, k], away_m[rows, k] = _towards(gaussians, is_dynamic, camera)
    for known, first in ((scene.static, 0), (scene.dynamic, len(scene.static))):
        if known.filled is not None:  # put where no frame saw anything
            weight[first : first + len(known)][known.filled] = 0
    sees = weight > _SEES * weight.amax(dim=1, keepdim=True).clamp(min=_LEAST_PX)
    number = sees.sum(dim=1).clamp(min=1)
    mean = (directions * sees[..., None]).sum(dim=1) / number[:, None]
    total = weight.sum(dim=1)
    return GaussianEvidence(
        weight_px=total,
        error=error / total.clamp(min=1e-6),
        sees=sees,
        directions=directions,
        nearest_m=torch.where(sees, away_m, torch.inf).amin(dim=1),
        spread_rad=(2 * (1 - mean.norm(dim=1)).clamp(min=0)).sqrt(),
    )


@torch.no_grad()
def seen_with(
    evidence: GaussianEvidence, scene: Scene, camera: Camera, t_s: float
) -> tuple[SceneView, Float[Tensor, "h w c"]]:
    """A view, and of each of its pixels what the recorded views tell of what it shows (``CHANNELS``).

    These are the root of the squared error there; how little it was seen, 0 to 1; the angle in radians to
    the nearest direction from which it was seen; the logarithm of how many times closer it is than ever;
    and that angle in terms of the spread of those directions.
    """
    gaussians, is_dynamic = moment_of(scene, t_s)
    rows = rows_at(scene, t_s)
    directions, away_m = _towards(gaussians, is_dynamic, camera)
    cosine = torch.einsum("nvc,nc->nv", evidence.directions[rows], directions)
    cosine = torch.where(evidence.sees[rows], cosine, -1.0).amax(dim=1)
    angle = torch.arccos(cosine.clamp(-1, 1)).clamp(max=_FARTHEST_RAD)
    closer = (evidence.nearest_m[rows] / away_m).clamp(1.0, _MOST_CLOSER).log()
    told = [
        *evidence.error_and_unseen(rows),
        angle,
        closer,
        (angle / (evidence.spread_rad[rows] + _FIRM_RAD)).clamp(max=_MOST_RATIO),
    ]
    view = render_scene(scene, camera, t_s, channels=torch.stack(told, dim=1), moment=(gaussians, is_dynamic))
    return view, view.channels / view.alpha.clamp(min=1e-3)[..., None]


def rows_at(scene: Scene, t_s: float) -> Int[Tensor, " m"]:
    """Which of all Gaussians ``moment_of`` gives at a time."""
    static = torch.arange(len(scene.static), device=scene.static.means.device)
    return torch.cat([static, len(static) + scene.dynamic.alive_at(t_s)])


def _shares(
    gaussians: Gaussians, camera: Camera, squared_error: Float[np.ndarray, "bh bw"]
) -> tuple[Float[Tensor, " m"], Float[Tensor, " m"]]:
    """What each Gaussian adds to a view in pixels, and that times the error there."""
    off = np.zeros((camera.height_px, camera.width_px), dtype=np.float32)
    spread = squared_error.repeat(BLOCK_PX, axis=0).repeat(BLOCK_PX, axis=1)
    off[: spread.shape[0], : spread.shape[1]] = spread
    told = torch.from_numpy(np.stack([np.ones_like(off), off], axis=-1))
    weight, error = shares(gaussians, camera, told).unbind(1)
    return weight, error


def _towards(
    gaussians: Gaussians, is_dynamic: Float[Tensor, " m"], camera: Camera
) -> tuple[Float[Tensor, "m 3"], Float[Tensor, " m"]]:
    """Unit vectors from Gaussians to a camera and its distance; in their own axes where they move."""
    away = torch.from_numpy(camera.world_from_camera[:3, 3]).float() - gaussians.means
    distance_m = away.norm(dim=1).clamp(min=1e-6)
    directions = away / distance_m[:, None]
    moving = torch.nonzero(is_dynamic > 0).squeeze(1)
    if len(moving):
        w, x, y, z = torch.nn.functional.normalize(gaussians.quaternions[moving], dim=1).unbind(1)
        axis, d = -torch.stack([x, y, z], dim=1), directions[moving]
        across = 2 * torch.linalg.cross(axis, d)
        directions[moving] = d + w[:, None] * across + torch.linalg.cross(axis, across)
    return directions, distance_m
