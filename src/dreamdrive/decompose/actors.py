"""Dynamic clusters become actors: one track each, and one canonical set of Gaussians in place of copies.

The initial points hold a moving car once per frame. Each cluster's copies are carried to one canonical time
along the cluster's own track, so that at any time the copies lie on top of each other where the car is; life
spans let the copies nearest in time speak loudest, see ``lives``.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import cv2
import numpy as np
import torch
from jaxtyping import Float, Int

from dreamdrive.decompose.flow import carried, neighbour_flow
from dreamdrive.decompose.group import Grouping, source_pixels
from dreamdrive.decompose.lives import Glimpse, lives
from dreamdrive.motion import Tracks
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry


@dataclass(frozen=True)
class ActorOptions:
    """Constants of the tracks.

    Figures are means over four drawn streets with corrupted references and true poses
    (``benchmarks/ablation.py``). Without any tracks held-out frames lose 0.71 dB, novel views 0.23 dB.

    Attributes:
        tracks: False leaves every copy in its place, alive for ever, for F_deform alone to move (eq. 11).
        lifespan_frames: Standard deviation of a copy's life span, in intervals between training frames. Three
            times as long, novel views lose 0.03 dB and standing things seem to move 43 mm farther.
        untracked_frames: The same for what has no track: a copy that stays where it was seen is wrong soon.
        lasting: Whether copies of what no other frame sees live on, see ``lives``: without it novel views
            lose 0.11 dB, and standing things seem to move 14 mm less.
        contact_weight: Trust in one frame's depth against that in the change of size between two frames; a
            frame that shows more of the actor weighs more.
        least_frames: Clusters seen in fewer frames get no track, only a short life.
        least_points: Flow vectors needed to measure a change of size and place.
        opacity: Opacity to start from: what moves hides what it passes, and must not leave the static
            Gaussians behind it to take on its colours.
    """

    tracks: bool = True
    lifespan_frames: float = 1.25
    untracked_frames: float = 0.5
    lasting: bool = True
    contact_weight: float = 0.05
    least_frames: int = 2
    least_points: int = 12
    opacity: float = 0.8


@dataclass(frozen=True)
class Cast:
    """All that moves.

    Attributes:
        gaussians: Dynamic Gaussians in canonical places, with actor and life span.
        tracks: Motion of the actors, or None when there are none.
        actors: The actors.
    """

    gaussians: Gaussians
    tracks: Tracks | None
    actors: tuple[Actor, ...]


@dataclass(frozen=True)
class _Path:
    """One cluster over the frames it was seen in."""

    frames: Int[np.ndarray, " k"]
    anchor_px: Float[np.ndarray, "k 2"]
    depth_m: Float[np.ndarray, " k"]
    seen_depth_m: Float[np.ndarray, " k"]


def cast(
    clip: Clip,
    geometry: Geometry,
    gaussians: Gaussians,
    grouping: Grouping,
    options: ActorOptions,
    reach_px: float,
) -> Cast:
    """Track every dynamic cluster and merge its copies, each where its source frame saw it.

    Copies within ``reach_px`` in an image are neighbours, see ``SeedOptions``. Held-out frames are not read.
    """
    index = np.flatnonzero(grouping.dynamic.numpy())
    chosen = gaussians.select(torch.from_numpy(index))
    if not len(index):
        return Cast(
            replace(chosen, lifespan=torch.zeros(0, 2), actor=torch.zeros(0, dtype=torch.int64)), None, ()
        )
    if not options.tracks:
        return Cast(chosen, None, ())
    pixels = source_pixels(geometry, gaussians, index)
    cluster = grouping.cluster.numpy()[index]
    frames = chosen.source_frame.numpy()
    flows = cache(partial(neighbour_flow, clip))
    paths = [
        _path(flows, pixels, frames, np.flatnonzero(cluster == c), options) for c in range(cluster.max() + 1)
    ]
    return _merge(clip, geometry, chosen, pixels, cluster, paths, options, reach_px)


def _path(
    flow_to: Callable[[int, int], Float[np.ndarray, "h w 2"]],
    pixels: Float[np.ndarray, "m 3"],
    frames: Int[np.ndarray, " m"],
    rows: Int[np.ndarray, " k"],
    options: ActorOptions,
) -> _Path:
    """Where one cluster's anchor is in each frame, and how deep.

    Between two frames a rigid thing's image changes by a similarity; its scale is the inverse ratio of
    depths, which flow measures far better than any single frame measures depth. The depths of single frames
    fix the common factor.
    """
    seen = np.unique(frames[rows])
    centres = np.array([np.median(pixels[rows[frames[rows] == f], :2], axis=0) for f in seen])
    contact = np.array([np.median(pixels[rows[frames[rows] == f], 2]) for f in seen])
    anchors = centres.copy()
    log_ratio, trust = np.zeros(max(len(seen) - 1, 0)), np.zeros(max(len(seen) - 1, 0))
    for k in range(len(seen) - 1):
        members = rows[frames[rows] == seen[k]]
        flow = flow_to(int(seen[k]), int(seen[k + 1]))
        similarity = _similarity(flow, pixels[members, :2], options)
        if similarity is None:
            continue
        anchors[k + 1] = similarity[:, :2] @ anchors[k] + similarity[:, 2]
        log_ratio[k] = -np.log(np.hypot(similarity[0, 0], similarity[1, 0]))
        trust[k] = 1.0
        drift = np.linalg.norm(anchors[k + 1] - centres[k + 1])
        spread = pixels[rows[frames[rows] == seen[k + 1]], :2].std(axis=0).max()
        if drift > 2 * spread + 4:
            anchors[k + 1] = centres[k + 1]
    # What shows little of a thing often misses where it stands.
    shown = np.array([np.count_nonzero(frames[rows] == f) for f in seen])
    weight = options.contact_weight * shown / shown.mean()
    depth = np.exp(_smooth_logs(np.log(contact), log_ratio, trust, weight))
    return _Path(seen, anchors, depth, contact)


def _similarity(
    flow: Float[np.ndarray, "h w 2"], points: Float[np.ndarray, "m 2"], options: ActorOptions
) -> Float[np.ndarray, "2 3"] | None:
    if len(points) < options.least_points:
        return None
    moved = carried(points, flow)
    cv2.setRNGSeed(0)
    result: Any = cv2.estimateAffinePartial2D(
        points, moved, method=cv2.RANSAC, ransacReprojThreshold=1.0, maxIters=500, confidence=0.999
    )
    found, inliers = result
    if found is None or int(inliers.sum()) < options.least_points:
        return None
    scale = float(np.hypot(found[0, 0], found[1, 0]))
    return found if 0.5 < scale < 2.0 else None


def _smooth_logs(
    seen: Float[np.ndarray, " k"],
    ratio: Float[np.ndarray, " j"],
    trust: Float[np.ndarray, " j"],
    weight: Float[np.ndarray, " k"],
) -> Float[np.ndarray, " k"]:
    """Least squares: close to ``seen`` weakly, to the measured differences strongly, at an even pace."""
    count = len(seen)
    rows, right = [np.diag(np.sqrt(weight))], [np.sqrt(weight) * seen]
    for k in range(count - 1):
        row = np.zeros((1, count))
        row[0, k], row[0, k + 1] = -1, 1
        rows.append(row * np.sqrt(max(float(trust[k]), 1e-3)))
        right.append(np.array([ratio[k] * np.sqrt(max(float(trust[k]), 1e-3))]))
    for k in range(1, count - 1):
        row = np.zeros((1, count))
        row[0, k - 1 : k + 2] = 1, -2, 1
        rows.append(0.5 * row)
        right.append(np.zeros(1))
    return np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0]


def _merge(
    clip: Clip,
    geometry: Geometry,
    chosen: Gaussians,
    pixels: Float[np.ndarray, "m 3"],
    cluster: Int[np.ndarray, " m"],
    paths: list[_Path],
    options: ActorOptions,
    reach_px: float,
) -> Cast:
    seen = np.flatnonzero(~clip.held_out)
    times = np.unique(clip.times_s[seen])
    interval = float(np.median(np.diff(times)))
    means = chosen.means.numpy().astype(np.float64)
    log_scales = chosen.log_scales.numpy().copy()
    opacity = torch.full_like(chosen.logit_opacities, math.log(options.opacity / (1 - options.opacity)))
    actor = np.full(len(means), -1, dtype=np.int64)
    frames = chosen.source_frame.numpy()
    untracked_s = np.full(len(means), options.untracked_frames * interval)
    lifespan = np.column_stack([clip.times_s[frames], untracked_s])
    deviation_s = options.lifespan_frames * interval
    translations, pivots, actors = [], [], []
    for c, path in enumerate(paths):
        if len(path.frames) < options.least_frames:
            continue
        rows = np.flatnonzero(cluster == c)
        places = _places(geometry, path)
        canonical_m = places[len(path.frames) // 2]
        offsets = _offsets_at(times, clip.times_s[path.frames], places - canonical_m)
        where = np.searchsorted(path.frames, frames[rows])
        stretch = path.depth_m[where] / path.seen_depth_m[where]
        centres = np.stack([geometry.cameras[f].world_from_camera[:3, 3] for f in frames[rows]])
        means[rows] = centres + (means[rows] - centres) * stretch[:, None] - (places - canonical_m)[where]
        log_scales[rows] += np.log(stretch)[:, None]
        actor[rows] = len(actors)
        lifespan[rows, 1] = deviation_s
        if options.lasting:
            glimpses = _glimpses(clip, geometry, path, places - canonical_m, pixels[rows], frames[rows])
            span_s = float(clip.times_s[0]), float(clip.times_s[-1])
            lifespan[rows] = lives(means[rows], where, glimpses, span_s, deviation_s, reach_px)
        translations.append(offsets)
        pivots.append(canonical_m)
        name = f"actor {len(actors)}"
        actors.append(Actor(len(actors), name, "unknown", len(rows), clip.times_s[path.frames], places))
    merged = replace(
        chosen,
        means=torch.tensor(means, dtype=torch.float32),
        log_scales=torch.tensor(log_scales, dtype=torch.float32),
        logit_opacities=opacity,
        actor=torch.from_numpy(actor),
        lifespan=torch.tensor(lifespan, dtype=torch.float32),
    )
    tracks = None
    if actors:
        stacked = np.stack(translations)
        tracks = Tracks(times, stacked, np.zeros(stacked.shape[:2]), np.stack(pivots))
    return Cast(merged, tracks, tuple(actors))


def _glimpses(
    clip: Clip,
    geometry: Geometry,
    path: _Path,
    offsets_m: Float[np.ndarray, "k 3"],
    pixels: Float[np.ndarray, "m 3"],
    frames: Int[np.ndarray, " m"],
) -> list[Glimpse]:
    """What each frame of a path saw of its cluster, as deep as the path says."""
    found: list[Glimpse] = []
    for k, frame in enumerate(path.frames.tolist()):
        copies = pixels[frames == frame] * [1, 1, path.depth_m[k] / path.seen_depth_m[k]]
        time_s = float(clip.times_s[frame])
        found.append(Glimpse(time_s, geometry.cameras[frame], offsets_m[k], copies, geometry.depth_m[frame]))
    return found


def _places(geometry: Geometry, path: _Path) -> Float[np.ndarray, "k 3"]:
    """The anchor in the world at each frame it was seen in."""
    places = []
    for frame, (u, v), depth in zip(path.frames.tolist(), path.anchor_px, path.depth_m, strict=True):
        camera = geometry.cameras[frame]
        local = np.array([(u - camera.cx_px) / camera.fx_px, (v - camera.cy_px) / camera.fy_px, 1.0]) * depth
        places.append(camera.world_from_camera[:3, :3] @ local + camera.world_from_camera[:3, 3])
    return np.array(places)


def _offsets_at(
    times: Float[np.ndarray, " t"], known_s: Float[np.ndarray, " k"], offsets: Float[np.ndarray, "k 3"]
) -> Float[np.ndarray, "t 3"]:
    """Offsets at all key times: linear between those known, constant velocity beyond them."""
    out = np.stack([np.interp(times, known_s, offsets[:, axis]) for axis in range(3)], axis=1)
    for beyond, a, b in ((times < known_s[0], 0, 1), (times > known_s[-1], -1, -2)):
        velocity = (offsets[a] - offsets[b]) / (known_s[a] - known_s[b])
        out[beyond] = offsets[a] + (times[beyond] - known_s[a])[:, None] * velocity
    return out
