"""Actors of dynamic clusters: one track each, and one canonical set of Gaussians in place of copies.

The initial points hold a moving car once per frame. Each cluster's copies are carried to one canonical time
along the cluster's own track, so that at any time the copies lie on top of each other where the car is; life
spans let the copies nearest in time speak loudest, see ``life_spans``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits
from torch import Tensor

from dreamdrive.compute.threads import parallel
from dreamdrive.decompose.actors.body import Body, body_of
from dreamdrive.decompose.actors.completing import completed
from dreamdrive.decompose.actors.life_spans import ActorView, life_spans, misplaced
from dreamdrive.decompose.actors.observations import PlacingOptions
from dreamdrive.decompose.actors.paths import Path, deeper, find_path
from dreamdrive.decompose.group import Grouping, source_pixels
from dreamdrive.motion import Tracks, multiply_quaternions
from dreamdrive.scene.actor import UNKNOWN, Actor, ActorBox, Track
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.street.street_class import ROAD_USERS, StreetClass
from dreamdrive.vision.flow import cells, single_threaded_opencv

_FADELESS = 100.0  # deviation of a life span over the length of the clip


@dataclass(frozen=True)
class ActorOptions:
    """Constants of the tracks; what they are worth: docs/results/ablation.md.

    Attributes:
        tracks: False leaves every copy in its place, alive for ever, for F_deform alone to move (eq. 11).
        lifespan_frames: Deviation of a copy's life span, in intervals between training frames.
        untracked_frames: The same for what has no track: a copy that stays where it was seen is wrong soon.
        lasting: Whether copies of what no other frame sees live on, see ``life_spans``.
        placing: How place, yaw and depth of a track are estimated.
        complete: Whether the side of a vehicle that no frame saw is mirrored, see ``completing``.
        least_frames: Clusters seen in fewer frames get no track, only a short life: two places are no path.
        carve: Whether copies are left out that other frames see past, see ``life_spans.misplaced``.
        opacity: Opacity to start from: the static Gaussians behind must not take on the colours.
    """

    tracks: bool = True
    lifespan_frames: float = 4.0
    untracked_frames: float = 0.5
    lasting: bool = True
    placing: PlacingOptions = field(default_factory=PlacingOptions)
    complete: bool = True
    least_frames: int = 2
    carve: bool = True
    opacity: float = 0.8


@dataclass(frozen=True)
class Actors:
    """All that moves.

    Attributes:
        gaussians: Dynamic Gaussians in canonical places, with actor and life span.
        tracks: Motion of the actors, or None when there are none.
        actors: The actors.
    """

    gaussians: Gaussians
    tracks: Tracks | None
    actors: tuple[Actor, ...]


def find_actors(
    clip: Clip,
    geometry: Geometry,
    gaussians: Gaussians,
    grouping: Grouping,
    options: ActorOptions,
    reach_px: float,
    known: Mapping[int, Path] = MappingProxyType({}),
) -> Actors:
    """Track every dynamic cluster and merge its copies, each where its source frame saw it.

    Copies within ``reach_px`` in an image are neighbours, see ``SeedOptions``. Held-out frames are not read.
    Paths that are known already, by cluster, are taken as they are. They name all frames that saw it.
    """
    index = np.flatnonzero(grouping.dynamic.numpy())
    chosen = gaussians.select(torch.from_numpy(index))
    if not len(index):
        return Actors(
            replace(chosen, lifespan=torch.zeros(0, 2), actor=torch.zeros(0, dtype=torch.int64)), None, ()
        )
    if not options.tracks:
        return Actors(chosen, None, ())
    pixels = source_pixels(geometry, gaussians, index)
    cluster, frames = grouping.cluster.numpy()[index], chosen.source_frame.numpy()

    def path_of(c: int) -> Path | None:
        if c in known:
            return known[c]
        rows = np.flatnonzero(cluster == c)
        seen = np.unique(frames[rows])
        if len(seen) < options.least_frames:
            return None
        shown = [pixels[rows[frames[rows] == frame]] for frame in seen]
        return find_path(clip, geometry, seen, shown, options.placing, reach_px)

    # Systems are small: with threads they take twice the time, and differ in the last digits.
    with threadpool_limits(1, "blas"), single_threaded_opencv():
        paths = parallel(path_of, range(cluster.max() + 1))
    return _merge(clip, geometry, chosen, pixels, cluster, paths, options, reach_px)


def _merge(
    clip: Clip,
    geometry: Geometry,
    chosen: Gaussians,
    pixels: Float[np.ndarray, "m 3"],
    cluster: Int[np.ndarray, " m"],
    paths: list[Path | None],
    options: ActorOptions,
    reach_px: float,
) -> Actors:
    times, interval_s = np.unique(clip.times_s[~clip.held_out]), clip.seen_interval_s
    logit = math.log(options.opacity / (1 - options.opacity))
    chosen = replace(chosen, logit_opacities=torch.full_like(chosen.logit_opacities, logit))
    frames = chosen.source_frame.numpy()
    parts: list[Gaussians] = []
    actors: list[Actor] = []
    for c, path in enumerate(paths):
        rows = np.flatnonzero(cluster == c)
        copies = chosen.select(torch.from_numpy(rows))
        if path is None:
            span = torch.full((len(rows),), options.untracked_frames * interval_s)
            parts.append(_of_actor(copies, -1, torch.stack([_times(clip, copies), span], dim=1)))
            continue
        views = _views(clip, geometry, path, pixels[rows], frames[rows])
        kind = _kind(clip, frames[rows], pixels[rows])
        copies = _carried_home(copies, geometry, path)
        own, body = _body_and_copies(clip, geometry, copies, path, views, kind, options, reach_px)
        parts += [_of_actor(part, len(actors), spans) for part, spans in own]
        actors.append(_actor(len(actors), kind, [part for part, _ in own], clip, path, body))
    merged = Gaussians.concatenate(*parts)
    return Actors(merged, _tracks(times, actors) if actors else None, tuple(actors))


def _body_and_copies(
    clip: Clip,
    geometry: Geometry,
    copies: Gaussians,
    path: Path,
    views: list[ActorView],
    kind: str,
    options: ActorOptions,
    reach_px: float,
) -> tuple[list[tuple[Gaussians, Float[Tensor, "n 2"]]], Body]:
    """What an actor is made of in its canonical place, with life spans, and its box."""
    copies = _placed_well(copies, views, reach_px) if options.carve else copies
    places = copies.means.numpy().astype(np.float64)
    body = body_of(places, path.placement.ahead, path.up, views, kind, geometry.ground)
    own = [(copies, _spans(clip, copies, path, views, options, reach_px))]
    unseen = completed(copies, body, views, reach_px) if options.complete else None
    return own + ([] if unseen is None else [(unseen, _always(clip, len(unseen)))]), body


def _actor(number: int, kind: str, own: list[Gaussians], clip: Clip, path: Path, body: Body) -> Actor:
    placement, moved = path.placement, [path.world_from_canonical(k) for k in range(len(path.frames))]
    feet_m = np.stack([pose[:3, :3] @ body.foot_m + pose[:3, 3] for pose in moved])
    return Actor(
        id=number,
        name=f"actor {number}",
        kind=kind,
        count=sum(len(part) for part in own),
        track=Track(clip.times_s[path.frames], feet_m, placement.yaw_rad),
        box=ActorBox(body.size_m, placement.ahead),
        spread_m=placement.spread_m,
        completed=len(own) > 1,
    )


def _kind(clip: Clip, frames: Int[np.ndarray, " m"], pixels: Float[np.ndarray, "m 3"]) -> str:
    """What the street network takes most of the pixels of road users for."""
    if not clip.looks:
        return UNKNOWN
    votes = np.zeros(len(StreetClass), int)
    for frame in np.unique(frames).tolist():
        camera = int(clip.camera[frame])
        shown = clip.looks[camera].classes[int((clip.camera[:frame] == camera).sum())]
        seen = shown[cells(pixels[frames == frame], shown.shape)]
        votes += np.bincount(seen, minlength=len(votes))
    most = max(ROAD_USERS, key=lambda each: votes[each])
    return most.name.lower().replace("_", "-") if votes[most] else UNKNOWN


def _of_actor(copies: Gaussians, actor: int, spans: Float[Tensor, "n 2"]) -> Gaussians:
    number = torch.full((len(copies),), actor, dtype=torch.int64)
    return replace(copies, actor=number, lifespan=spans.to(torch.float32))


def _times(clip: Clip, copies: Gaussians) -> Float[Tensor, " n"]:
    return torch.from_numpy(clip.times_s[copies.source_frame.numpy()]).to(torch.float32)


def _always(clip: Clip, count: int) -> Float[Tensor, "n 2"]:
    """Life spans in which nothing fades while the clip lasts."""
    first_s, last_s = float(clip.times_s[0]), float(clip.times_s[-1])
    return torch.tensor([(first_s + last_s) / 2, _FADELESS * (last_s - first_s)]).repeat(count, 1)


def _carried_home(copies: Gaussians, geometry: Geometry, path: Path) -> Gaussians:
    """Copies of an actor where it is in its canonical place, as deep as the path says."""
    placement, frames = path.placement, copies.source_frame.numpy()
    where = np.searchsorted(path.frames, frames)
    stretch = np.zeros(len(copies))
    for k, factors in enumerate(path.stretch):
        stretch[where == k] = factors
    means = copies.means.numpy().astype(np.float64)
    centres = np.stack([geometry.cameras[f].world_from_camera[:3, 3] for f in frames])
    seen_m = centres + (means - centres) * stretch[:, None]
    back = Rotation.from_rotvec(-placement.yaw_rad[where][:, None] * path.up)
    means = path.pivot_m + back.apply(seen_m - placement.place_m[where])
    grown = copies.log_scales + torch.from_numpy(np.log(stretch))[:, None]
    return replace(
        copies,
        means=torch.tensor(means, dtype=torch.float32),
        quaternions=_turned(back, copies.quaternions),
        log_scales=grown.to(torch.float32),
    )


def _placed_well(copies: Gaussians, views: list[ActorView], reach_px: float) -> Gaussians:
    """The copies that other frames confirm or cannot see; all of them where that leaves none."""
    places = copies.means.numpy().astype(np.float64)
    kept = np.flatnonzero(~misplaced(places, views, reach_px))
    return copies.select(torch.from_numpy(kept)) if len(kept) else copies


def _spans(
    clip: Clip,
    copies: Gaussians,
    path: Path,
    views: list[ActorView],
    options: ActorOptions,
    reach_px: float,
) -> Float[Tensor, "n 2"]:
    deviation_s = options.lifespan_frames * clip.seen_interval_s
    if not options.lasting:
        times_s = _times(clip, copies)
        return torch.stack([times_s, torch.full_like(times_s, deviation_s)], dim=1)
    where = np.searchsorted(path.frames, copies.source_frame.numpy())
    whole_s = float(clip.times_s[0]), float(clip.times_s[-1])
    places = copies.means.numpy().astype(np.float64)
    return torch.from_numpy(life_spans(places, where, views, whole_s, deviation_s, reach_px))


def _tracks(times: Float[np.ndarray, " t"], actors: list[Actor]) -> Tracks:
    """Key frames at these times; each actor turns about where it is in its canonical place."""
    keyed = [actor.track.at(times) for actor in actors]
    pivots_m = [actor.track.positions_m[len(actor.track.times_s) // 2] for actor in actors]
    moves = [track.positions_m - pivot_m for track, pivot_m in zip(keyed, pivots_m, strict=True)]
    return Tracks(times, np.stack(moves), np.stack([track.yaw_rad for track in keyed]), np.stack(pivots_m))


def _turned(by: Rotation, quaternions: Float[Tensor, "n 4"]) -> Float[Tensor, "n 4"]:
    turn = torch.from_numpy(by.as_quat(scalar_first=True)).to(quaternions)
    return multiply_quaternions(turn, quaternions)


def _views(
    clip: Clip,
    geometry: Geometry,
    path: Path,
    pixels: Float[np.ndarray, "m 3"],
    frames: Int[np.ndarray, " m"],
) -> list[ActorView]:
    """What each frame of a path saw of its cluster, as deep as the path says."""
    found: list[ActorView] = []
    for k, frame in enumerate(path.frames.tolist()):
        copies = deeper(pixels[frames == frame], path.stretch[k])
        camera, moved = geometry.cameras[frame], path.world_from_canonical(k)
        found.append(ActorView(float(clip.times_s[frame]), camera, moved, copies, geometry.depth_m[frame]))
    return found
