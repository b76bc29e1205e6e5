"""The street behind what is taken away: what no frame saw of it goes, and holes are filled from around."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from dreamdrive.complete import surface
from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.edit.doubles import without_doubles
from dreamdrive.edit.shadow import (
    LEAST_WEIGHT,
    REACH_M,
    UNSEEN,
    beside,
    places_beside,
    shade_of,
    within,
    without_shade,
)
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import SceneView, moment_of, render_scene, shares

HOLE_ALPHA, COVERED_ALPHA = 0.4, 0.1
"""Pixels with less of the street are a hole where the actor covered that much of them."""
LEFT_ALPHA, RIM_PX = 0.01, 5
"""Of a pixel, from which on it shows the actor, and how far around such pixels the splat's filter reaches."""
TOUCH_PX = 1e-4
"""What a Gaussian may add to a view beyond these, in pixels: nothing that can be seen."""
SLIGHT_PX = 0.2
"""As much of one in the shadow, or inside an actor. With 0.03 the shadow stays (0.3 to 1 dB of what changes
on drawn streets), with 1 twice as many pixels change where nothing should."""
VIEWS = 6
"""Recorded views that holes are filled from; what one of them filled the next does not fill again."""
_AROUND_PX, _LEAST_PX = 5.0, 12


@dataclass(frozen=True)
class _Seen:
    """What each static Gaussian adds to each view, in pixels (V, N), and where an actor left (V, H, W).

    ``there`` is with the actors where they were, ``away`` without, ``beyond`` without and outside ``left``,
    ``aside`` that outside their shadows too.
    """

    there: Float[Tensor, "v n"]
    away: Float[Tensor, "v n"]
    beyond: Float[Tensor, "v n"]
    aside: Float[Tensor, "v n"]
    left: tuple[Bool[np.ndarray, "h w"], ...]

    @property
    def best(self) -> Float[Tensor, " n"]:
        """The most that one would add to any view."""
        return self.away.amax(dim=0)

    @property
    def hidden(self) -> Bool[Tensor, " n"]:
        """Which ones views would show, and have seen through the actors alone."""
        unseen = self.there.amax(dim=0) < UNSEEN * self.best
        return (self.best > LEAST_WEIGHT) & unseen & (self.beyond.amax(dim=0) < TOUCH_PX)


@one_torch_thread()
def filled_behind(before: Scene, after: Scene) -> Scene:
    """``after``, which lacks actors at places where ``before`` has them, with the street behind these.

    Only the recorded views tell where something was hidden. Of what never moved, Gaussians that all of them
    saw through the actors alone are taken out; what then is a hole in a view is filled with colours and
    depths from beside it (colours by Telea 2004), at its place in space, and marked as filled, as far as no
    view shows it beside what was hidden. The shadow of who leaves is taken off, as far as it lies on road
    that no frame saw in the light. Smaller actors inside one who leaves go with it.
    """
    leave = [actor for actor in before.actors if _leaves(actor, after)]
    if not leave:
        return after
    after = without_doubles(before, after, leave)
    views = [i for i in before.front.tolist() if not before.held_out[i]]
    seen = _seen(before, after, leave, views)
    made = _lit(before, after, leave, views, seen)
    away = seen.hidden | _ghosts(before, leave, views, seen)
    made = replace(made, static=made.static.select(~away))
    street = len(made.static)
    chosen = views[:: max(1, len(views) // VIEWS)]
    for view in chosen[::-1]:  # from the last on: it is the nearest to what lies behind
        added = _fill(before, made, view)
        if added is not None:
            made = made.with_standing(added)
    return _clipped(made, street, views, seen.left)


def _leaves(actor: Actor, after: Scene) -> bool:
    """Whether an actor is not, at all times, where it was."""
    for other in after.actors:
        if other.id == actor.id:
            then, now = actor.track, other.track
            pairs = ((getattr(then, f.name), getattr(now, f.name)) for f in fields(then))
            return not all(np.array_equal(a, b) for a, b in pairs)
    return True


def _seen(before: Scene, after: Scene, leave: Sequence[Actor], views: Sequence[int]) -> _Seen:
    there, away, left = [], [], []
    for view in views:
        camera, t_s = before.cameras[view], float(before.times_s[view])
        was = render_scene(before, camera, t_s)
        gone = (was.dynamic_share - render_scene(after, camera, t_s).dynamic_share).abs() > LEFT_ALPHA
        left.append(cv2.dilate(gone.numpy().astype(np.uint8), np.ones((RIM_PX, RIM_PX))) > 0)
        shaded = left[-1] | _road_beside(leave, camera, was, t_s, before.up)
        there.append(_weights(before, before, view)[:, 0])
        away.append(_weights(after, before, view, ~left[-1], ~shaded))
    every = torch.stack(away)
    return _Seen(torch.stack(there), every[..., 0], every[..., 1], every[..., 2], tuple(left))


def _road_beside(
    leave: Sequence[Actor], camera: Camera, seen: SceneView, t_s: float, up: Float[np.ndarray, "3"]
) -> Bool[np.ndarray, "h w"]:
    """Pixels of a view that show road where the shadow of an actor may be."""
    rows, columns = np.indices((camera.height_px, camera.width_px)) + 0.5
    points = camera.lift(np.column_stack([columns.ravel(), rows.ravel(), seen.depth_m.numpy().ravel()]))
    found = np.zeros(len(points), dtype=bool)
    for actor in leave:
        if actor.box is not None:
            found |= beside(places_beside(points, actor, t_s, up), actor, REACH_M)
    return found.reshape(camera.height_px, camera.width_px)


def _lit(before: Scene, after: Scene, leave: Sequence[Actor], views: Sequence[int], seen: _Seen) -> Scene:
    """``after`` with the shadows of those who leave off the road; without a box none is found."""
    made, times_s = after, before.times_s[list(views)].tolist()
    aside = seen.aside.amax(dim=0) >= SLIGHT_PX
    for actor in leave:
        if actor.box is not None:
            shade = shade_of(before, actor, times_s, seen.there, seen.best)
            made = made if shade is None else without_shade(made, shade.less(aside.numpy()))
    return made


def _ghosts(before: Scene, leave: Sequence[Actor], views: Sequence[int], seen: _Seen) -> Bool[Tensor, " n"]:
    """What never moved inside the box of one who leaves: where a thing drives nothing can stand."""
    means = before.static.means.double().numpy()
    found = np.zeros(len(means), dtype=bool)
    for actor in leave:
        for t_s in before.times_s[list(views)].tolist():
            if actor.box is not None and actor.track.first_s <= t_s <= actor.track.last_s:
                found |= within(places_beside(means, actor, t_s, before.up), actor)
    return torch.from_numpy(found) & (seen.beyond.amax(dim=0) < SLIGHT_PX)


def _weights(
    scene: Scene, recorded: Scene, view: int, *masks: Bool[np.ndarray, "h w"]
) -> Float[Tensor, "n k"]:
    """What each static Gaussian adds to a view in pixels, to all of it and to each mask."""
    camera = recorded.cameras[view]
    gaussians, _ = moment_of(scene, float(recorded.times_s[view]))
    every = np.ones((camera.height_px, camera.width_px), dtype=bool)
    of = torch.from_numpy(np.stack([every, *masks], axis=-1).astype(np.float32))
    return shares(gaussians, camera, of)[: len(scene.static)]


def _clipped(made: Scene, first: int, views: Sequence[int], left: Sequence[Bool[np.ndarray, "h w"]]) -> Scene:
    """Less those static Gaussians from row ``first`` on that a view shows beside what was hidden."""
    if first == len(made.static):
        return made
    kept = torch.ones(len(made.static), dtype=torch.bool)
    for view, mask in zip(views, left, strict=True):
        kept[first:] &= _weights(made, made, view, ~mask)[first:, 1] < TOUCH_PX
    return replace(made, static=made.static.select(kept))


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
    return surface(camera, pixels, picture[rows, columns] / 255.0, view) if len(rows) else None


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
