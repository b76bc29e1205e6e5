"""The path of a moving thing: where it is in each frame that saw it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt8
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from dreamdrive.decompose.actors.observations import (
    Carried,
    Observations,
    Placement,
    PlacingOptions,
    PointDepth,
    is_whole,
)
from dreamdrive.decompose.actors.placing import placed
from dreamdrive.scene.camera import NEAR_M
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.vision.flow import grey, guided

_ROUNDS = (1,), (1,), (1, 3)  # how many frames apart; flow starts from the path that the flow before gave
_NEIGHBOURS = 9  # points that tell the depth of one beside them
_LEAST_POINTS = 12  # that flow carries from frame to frame
_UP = np.array([0.0, -1.0, 0.0])  # where no road tells it


@dataclass(frozen=True)
class Path:
    """Places of a rigid thing in the frames that saw it, in order; ``up`` is the axis of yaw.

    ``stretch`` has for each frame a factor of the depth of each place that it showed.
    """

    frames: Int[np.ndarray, " k"]
    placement: Placement
    up: Float[np.ndarray, "3"]
    stretch: tuple[Float[np.ndarray, " _"], ...]

    @property
    def pivot_m(self) -> Float[np.ndarray, "3"]:
        """What it turns about, in its canonical place: where it is in the middle one of the frames."""
        return self.placement.place_m[len(self.frames) // 2]

    def world_from_canonical(self, at: int) -> Float[np.ndarray, "4 4"]:
        """From the canonical place to that in one of the frames."""
        moved = np.eye(4)
        moved[:3, :3] = Rotation.from_rotvec(self.placement.yaw_rad[at] * self.up).as_matrix()
        moved[:3, 3] = self.placement.place_m[at] - moved[:3, :3] @ self.pivot_m
        return moved


def find_path(
    clip: Clip,
    geometry: Geometry,
    frames: Int[np.ndarray, " k"],
    shown: list[Float[np.ndarray, "_ 3"]],
    options: PlacingOptions,
    reach_px: float,
) -> Path | None:
    """The path of a thing, of which frames show places (column, row, depth along z); None for no likely one.

    The depth alone gives a first path. From there flow is looked for where the path leads, for between two
    frames oncoming traffic moves farther than flow finds by itself. Places at most ``reach_px`` apart are
    neighbours.
    """
    observations = _observations(clip, geometry, frames, shown, reach_px)
    up = _UP if geometry.ground is None else geometry.ground.normal_world
    pictures = [grey(clip.frames[frame]) for frame in frames]
    path = _path(frames, placed(observations, (), up, options), up, shown)
    for gaps in _ROUNDS:
        pairs = [(k, k + way * gap) for k in range(len(frames)) for gap in gaps for way in (-1, 1)]
        among = [pair for pair in pairs if 0 <= pair[1] < len(frames)]
        found = [_carried(*pair, pictures, geometry, path, shown, options, reach_px) for pair in among]
        carried = [each for each in found if each is not None]
        better = _path(frames, placed(observations, carried, up, options), up, shown)
        # Of a few wrong points motion may run away; then the path stays that from which they were looked for.
        path = better if _likely(better.placement, clip.times_s[frames], options) else path
    return path if _likely(path.placement, clip.times_s[frames], options) else None


def _likely(placement: Placement, times_s: Float[np.ndarray, " k"], options: PlacingOptions) -> bool:
    """Whether a thing can have gone so; a few stray points leap, or their place is nowhere sure."""
    steps_m = np.linalg.norm(np.diff(placement.place_m, axis=0), axis=1)
    speed_m_s = float(np.median(steps_m / np.diff(times_s))) if len(steps_m) else 0.0
    return speed_m_s < options.most_m_s and float(np.median(placement.spread_m)) < options.most_spread_m


def _path(
    frames: Int[np.ndarray, " k"],
    placement: Placement,
    up: Float[np.ndarray, "3"],
    shown: list[Float[np.ndarray, "_ 3"]],
) -> Path:
    points = placement.points or [None] * len(frames)
    of_frames = zip(shown, points, placement.factor, strict=True)
    return Path(frames, placement, up, tuple(_stretch(*each) for each in of_frames))


def _stretch(
    places: Float[np.ndarray, "m 3"], known: PointDepth | None, factor: float
) -> Float[np.ndarray, " m"]:
    """Factor of the depth of all places of a frame: that of the points beside them."""
    if known is None or len(known.point) < _NEIGHBOURS:
        return np.full(len(places), factor)
    _, near = KDTree(places[known.point, :2]).query(places[:, :2], k=_NEIGHBOURS)
    return np.median(known.factor[near], axis=1)


def deeper(places: Float[np.ndarray, "m 3"], factor: Float[np.ndarray, " m"]) -> Float[np.ndarray, "m 3"]:
    """Places (column, row, depth) with their depths multiplied."""
    return np.column_stack([places[:, :2], places[:, 2] * factor])


def _observations(
    clip: Clip,
    geometry: Geometry,
    frames: Int[np.ndarray, " k"],
    shown: list[Float[np.ndarray, "_ 3"]],
    reach_px: float,
) -> Observations:
    cameras = [geometry.cameras[frame] for frame in frames]
    middles_m = [np.median(camera.lift(each), axis=0) for camera, each in zip(cameras, shown, strict=True)]
    whole = [is_whole(each, clip.size[0], reach_px) for each in shown]
    return Observations(cameras, clip.times_s[frames], np.stack(middles_m), np.array(whole))


def _carried(
    k: int,
    to: int,
    pictures: list[UInt8[np.ndarray, "h w"]],
    geometry: Geometry,
    path: Path,
    shown: list[Float[np.ndarray, "_ 3"]],
    options: PlacingOptions,
    reach_px: float,
) -> Carried | None:
    """What flow carries from a frame onto the same thing in another one."""
    frame, other = int(path.frames[k]), int(path.frames[to])
    number = np.arange(0, len(shown[k]), max(1, len(shown[k]) // options.samples))
    chosen = shown[k][number]
    if len(chosen) < _LEAST_POINTS:
        return None
    step = path.world_from_canonical(to) @ np.linalg.inv(path.world_from_canonical(k))
    points = geometry.cameras[frame].lift(deeper(chosen, path.stretch[k][number]))
    expected = geometry.cameras[other].project(points @ step[:3, :3].T + step[:3, 3])
    if (expected[:, 2] <= NEAR_M).any():
        return None
    moved, kept = guided(pictures[k], pictures[to], chosen[:, :2], expected[:, :2])
    distance, nearest = KDTree(shown[to][:, :2]).query(moved, distance_upper_bound=1.5 * reach_px)
    kept &= np.isfinite(distance)
    if kept.sum() < _LEAST_POINTS:
        return None
    depth_m = shown[to][np.asarray(nearest)[kept], 2]
    return Carried(k, to, number[kept], chosen[kept, :2], chosen[kept, 2], moved[kept], depth_m)
