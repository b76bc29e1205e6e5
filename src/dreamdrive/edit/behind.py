"""The street behind what is taken away: what no frame saw of it goes, and holes are filled from around."""

from collections.abc import Sequence
from dataclasses import fields, replace

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.edit.shadow import LEAST_WEIGHT, UNSEEN, shade_of, without_shade
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import moment_of, render, render_scene

HOLE_ALPHA, COVERED_ALPHA = 0.4, 0.1
"""Pixels with less of the street are a hole where the actor covered that much of them."""
VIEWS = 6
"""Recorded views that holes are filled from; what one of them filled the next does not fill again."""
_AROUND_PX, _LEAST_PX = 5.0, 12


@one_torch_thread()
def filled_behind(before: Scene, after: Scene) -> Scene:
    """``after``, which lacks actors at places where ``before`` has them, with the street behind these.

    Only the recorded views tell where something was hidden. Of what never moved, Gaussians that all of them
    saw through the actors alone are taken out; what then is a hole in a view is filled with colours and
    depths from beside it (colours by Telea 2004), at its place in space, and marked as filled. The shadow of
    who leaves is taken off, as far as it lies on road that no frame saw in the light.
    """
    leave = [actor for actor in before.actors if _leaves(actor, after)]
    if not leave:
        return after
    views = [i for i in before.front.tolist() if not before.held_out[i]]
    there, away = (torch.stack([_weights(s, before, view) for view in views]) for s in (before, after))
    best = away.amax(dim=0)
    made = _lit(before, after, leave, views, there, best)
    unseen = (best > LEAST_WEIGHT) & (there.amax(dim=0) < UNSEEN * best)
    made = replace(made, static=made.static.select(torch.nonzero(~unseen).squeeze(1)))
    chosen = views[:: max(1, len(views) // VIEWS)]
    for view in chosen[::-1]:  # from the last on: it is the nearest to what lies behind
        added = _fill(before, made, view)
        if added is not None:
            made = made.with_standing(added)
    return made


def _leaves(actor: Actor, after: Scene) -> bool:
    """Whether an actor is not, at all times, where it was."""
    for other in after.actors:
        if other.id == actor.id:
            then, now = actor.track, other.track
            pairs = ((getattr(then, f.name), getattr(now, f.name)) for f in fields(then))
            return not all(np.array_equal(a, b) for a, b in pairs)
    return True


def _lit(
    before: Scene,
    after: Scene,
    leave: Sequence[Actor],
    views: Sequence[int],
    seen: Float[Tensor, "v n"],
    most: Float[Tensor, " n"],
) -> Scene:
    """``after`` with the shadows of those who leave off the road; without a box none is found."""
    made, times_s = after, before.times_s[list(views)].tolist()
    for actor in leave:
        shade = None if actor.box is None else shade_of(before, actor, times_s, seen, most)
        made = made if shade is None else without_shade(made, shade)
    return made


def _weights(scene: Scene, recorded: Scene, view: int) -> Float[Tensor, " n"]:
    """What each static Gaussian adds to a view, in pixels: the gradient of a channel that all share."""
    camera, t_s = recorded.cameras[view], float(recorded.times_s[view])
    gaussians, _ = moment_of(scene, t_s)
    with torch.enable_grad():
        ones = torch.ones(len(gaussians), 1, requires_grad=True)
        render(gaussians, camera, channels=ones, sh_degree=0).channels.sum().backward()
    assert ones.grad is not None
    return ones.grad[: len(scene.static), 0]


@torch.no_grad()
def _fill(before: Scene, after: Scene, view: int) -> Gaussians | None:
    """Gaussians for the hole of a view; None where there is none, or nothing around it."""
    camera, t_s = before.cameras[view], float(before.times_s[view])
    seen = render_scene(after, camera, t_s, exposure=False)
    gone = render_scene(before, camera, t_s).dynamic_share - seen.dynamic_share
    depth_m, alpha = seen.depth_m.numpy(), seen.alpha.numpy()
    hole = (gone > COVERED_ALPHA).numpy() & (alpha < HOLE_ALPHA)
    hole &= (alpha > HOLE_ALPHA).cumsum(axis=0) > 0  # what has nothing solid above it is sky
    if hole.sum() < _LEAST_PX or not (depth_m[~hole] > 0).any():
        return None
    mask = cv2.dilate(hole.astype(np.uint8), np.ones((3, 3), np.uint8))
    picture = cv2.inpaint(seen.picture, mask, _AROUND_PX, cv2.INPAINT_TELEA)
    z_m = _across(depth_m, (mask == 0) & (depth_m > 0) & (alpha > HOLE_ALPHA), hole)
    rows, columns = np.nonzero(hole & np.isfinite(z_m))
    pixels = np.column_stack([columns + 0.5, rows + 0.5, z_m[rows, columns]])
    return _surface(camera, pixels, picture[rows, columns] / 255.0, view) if len(rows) else None


def _across(
    depth_m: Float[np.ndarray, "h w"], known: Bool[np.ndarray, "h w"], hole: Bool[np.ndarray, "h w"]
) -> Float[np.ndarray, "h w"]:
    """Depth in a hole, even in 1 / depth from its left to its right: a road is as far all along a row.

    Where nothing in a row is known it is NaN.
    """
    filled = np.full(depth_m.shape, np.nan)
    for row in np.flatnonzero(hole.any(axis=1) & known.any(axis=1)):
        there, wanted = np.flatnonzero(known[row]), np.flatnonzero(hole[row])
        filled[row, wanted] = 1 / np.interp(wanted, there, 1 / depth_m[row, there])
    return filled


def _surface(
    camera: Camera, pixels: Float[np.ndarray, "n 3"], colours: Float[np.ndarray, "n 3"], view: int
) -> Gaussians:
    """A Gaussian for each pixel (column, row, depth), as large as it, facing the camera."""
    count = len(pixels)
    size_m = torch.from_numpy(0.6 * pixels[:, 2] / camera.fx_px).float()
    return Gaussians(
        means=torch.from_numpy(camera.lift(pixels)).float(),
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        log_scales=size_m.clamp(min=1e-4).log()[:, None].repeat(1, 3),
        logit_opacities=torch.full((count,), 3.0),
        sh=((torch.from_numpy(colours).float() - 0.5) / SH_C0)[:, None],
        source_frame=torch.full((count,), view, dtype=torch.int64),
        filled=torch.ones(count, dtype=torch.bool),
    )
