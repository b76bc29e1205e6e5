"""Dynamic clusters become actors: one track each, and one canonical set of Gaussians in place of copies.

The initial points hold a moving car once per frame. Each cluster's copies are carried to one canonical time
along the cluster's own track, so that at any time the copies lie on top of each other where the car is; life
spans let the copies nearest in time speak loudest, see ``lives``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation
from torch import Tensor

from dreamdrive.decompose.glances import PlacingOptions
from dreamdrive.decompose.group import Grouping, source_pixels
from dreamdrive.decompose.lives import Glimpse, lives
from dreamdrive.decompose.paths import Path, deeper, find_path
from dreamdrive.motion import Tracks, multiply_quaternions
from dreamdrive.scene.actor import Actor, Track
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
        lifespan_frames: Standard deviation of a copy's life span, in intervals between training frames. On
            drawn streets 0-3 (clean references, true poses) 1.25 loses 0.6 dB in held-out frames and 0.1 dB
            2 m aside.
        untracked_frames: The same for what has no track: a copy that stays where it was seen is wrong soon.
        lasting: Whether copies of what no other frame sees live on, see ``lives``: without it novel views
            lose 0.11 dB, and standing things seem to move 14 mm less.
        placing: How place, yaw and depth of a track are estimated.
        least_frames: Clusters seen in fewer frames get no track, only a short life.
        opacity: Opacity to start from: what moves hides what it passes, and must not leave the static
            Gaussians behind it to take on its colours.
    """

    tracks: bool = True
    lifespan_frames: float = 4.0
    untracked_frames: float = 0.5
    lasting: bool = True
    placing: PlacingOptions = field(default_factory=PlacingOptions)
    least_frames: int = 2
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


def cast(
    clip: Clip,
    geometry: Geometry,
    gaussians: Gaussians,
    grouping: Grouping,
    options: ActorOptions,
    reach_px: float,
    known: Mapping[int, Path] = MappingProxyType({}),
) -> Cast:
    """Track every dynamic cluster and merge its copies, each where its source frame saw it.

    Copies within ``reach_px`` in an image are neighbours, see ``SeedOptions``. Held-out frames are not read.
    Paths that are known already, by cluster, are taken as they are. They name all frames that saw it.
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
    cluster, frames = grouping.cluster.numpy()[index], chosen.source_frame.numpy()
    paths: list[Path | None] = []
    for c in range(cluster.max() + 1):
        if c in known:
            paths.append(known[c])
            continue
        rows = np.flatnonzero(cluster == c)
        seen = np.unique(frames[rows])
        shown = [pixels[rows[frames[rows] == frame]] for frame in seen]
        tracked = len(seen) >= options.least_frames
        paths.append(find_path(clip, geometry, seen, shown, options.placing, reach_px) if tracked else None)
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
) -> Cast:
    seen = np.flatnonzero(~clip.held_out)
    times = np.unique(clip.times_s[seen])
    interval = float(np.median(np.diff(times)))
    means = chosen.means.numpy().astype(np.float64)
    log_scales = chosen.log_scales.numpy().copy()
    quaternions = chosen.quaternions.clone()
    opacity = torch.full_like(chosen.logit_opacities, math.log(options.opacity / (1 - options.opacity)))
    actor = np.full(len(means), -1, dtype=np.int64)
    frames = chosen.source_frame.numpy()
    untracked_s = np.full(len(means), options.untracked_frames * interval)
    lifespan = np.column_stack([clip.times_s[frames], untracked_s])
    deviation_s = options.lifespan_frames * interval
    actors: list[Actor] = []
    for c, path in enumerate(paths):
        if path is None:
            continue
        rows = np.flatnonzero(cluster == c)
        placement = path.placement
        where = np.searchsorted(path.frames, frames[rows])
        stretch = np.zeros(len(rows))
        for k, factors in enumerate(path.stretch):
            stretch[where == k] = factors
        centres = np.stack([geometry.cameras[f].world_from_camera[:3, 3] for f in frames[rows]])
        seen_m = centres + (means[rows] - centres) * stretch[:, None]
        back = Rotation.from_rotvec(-placement.yaw_rad[where][:, None] * path.up)
        means[rows] = path.pivot_m + back.apply(seen_m - placement.place_m[where])
        quaternions[rows] = _turned(back, quaternions[rows])
        log_scales[rows] += np.log(stretch)[:, None]
        actor[rows] = len(actors)
        lifespan[rows, 1] = deviation_s
        if options.lasting:
            glimpses = _glimpses(clip, geometry, path, pixels[rows], frames[rows])
            span_s = float(clip.times_s[0]), float(clip.times_s[-1])
            lifespan[rows] = lives(means[rows], where, glimpses, span_s, deviation_s, reach_px)
        track = Track(clip.times_s[path.frames], placement.place_m, placement.yaw_rad)
        number = len(actors)
        actors.append(Actor(number, f"actor {number}", "unknown", len(rows), track, placement.spread_m))
    merged = replace(
        chosen,
        means=torch.tensor(means, dtype=torch.float32),
        quaternions=quaternions,
        log_scales=torch.tensor(log_scales, dtype=torch.float32),
        logit_opacities=opacity,
        actor=torch.from_numpy(actor),
        lifespan=torch.tensor(lifespan, dtype=torch.float32),
    )
    pivots = [path.pivot_m for path in paths if path is not None]
    return Cast(merged, _tracks(times, actors, pivots) if actors else None, tuple(actors))


def _tracks(
    times: Float[np.ndarray, " t"], actors: list[Actor], pivots_m: list[Float[np.ndarray, "3"]]
) -> Tracks:
    """Key frames at these times, about the points that the actors turn about."""
    keyed = [actor.track.at(times) for actor in actors]
    moves = [track.positions_m - pivot_m for track, pivot_m in zip(keyed, pivots_m, strict=True)]
    return Tracks(times, np.stack(moves), np.stack([track.yaw_rad for track in keyed]), np.stack(pivots_m))


def _turned(by: Rotation, quaternions: Float[Tensor, "n 4"]) -> Float[Tensor, "n 4"]:
    turn = torch.from_numpy(by.as_quat(scalar_first=True)).to(quaternions)
    return multiply_quaternions(turn, quaternions)


def _glimpses(
    clip: Clip,
    geometry: Geometry,
    path: Path,
    pixels: Float[np.ndarray, "m 3"],
    frames: Int[np.ndarray, " m"],
) -> list[Glimpse]:
    """What each frame of a path saw of its cluster, as deep as the path says."""
    found: list[Glimpse] = []
    for k, frame in enumerate(path.frames.tolist()):
        copies = deeper(pixels[frames == frame], path.stretch[k])
        camera, moved = geometry.cameras[frame], path.world_from_canonical(k)
        found.append(Glimpse(float(clip.times_s[frame]), camera, moved, copies, geometry.depth_m[frame]))
    return found
