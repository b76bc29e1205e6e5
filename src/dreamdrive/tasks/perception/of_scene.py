"""Samples of generated scenes: pictures along new paths, labels of the drive that a scene was made of.

What is labelled stays where it is at a time; the car is somewhere else, and so are the labels around it. How
much of a box is seen is told by the depth of the pictures themselves.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.log import Log, LogCamera, LogMap, OfLog, box_corners
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.scene.visibility import RECONSTRUCTED, View, level_of, share_seen
from dreamdrive.splat import moment_of, render_scene
from dreamdrive.tasks.perception.bev_set import SampleNote, cameras_of, note_of
from dreamdrive.tasks.perception.grid import BevGrid
from dreamdrive.tasks.perception.network.inputs import BevSample, camera_from_level_ego
from dreamdrive.tasks.perception.of_log import annotation_of, boxes_at, in_order, road_map
from dreamdrive.tasks.perception.options import ImageSize
from dreamdrive.tasks.perception.raster import Annotation, bev_labels
from dreamdrive.trust import SceneTrust

NEAR_M = 70.0
"""Boxes that are farther from the car are outside of all labels."""


@dataclass(frozen=True)
class PathOptions:
    """Where new samples of a scene are.

    Attributes:
        aside_m: Most to the left or right of the recorded path: about half a lane.
        turned_deg: Most to the left or right of the recorded direction.
        apart_m: Samples of a scene that are nearer in place than this ...
        apart_deg: ... and in direction than this ...
        apart_s: ... and in time than this are the same to a network: one of them is left out.
        least_covered: Share of the pixels below the horizon, of all pictures, that the scene has to cover.
        least_psnr_db: PSNR to expect, in the mean over all pictures, see ``trust``; without it any will do.
    """

    aside_m: float = 1.5
    turned_deg: float = 6.0
    apart_m: float = 0.3
    apart_deg: float = 1.0
    apart_s: float = 0.2
    least_covered: float = 0.6
    least_psnr_db: float | None = None


TOO_LITTLE, TOO_DOUBTFUL = "too little of it is in the scene", "less can be believed than is asked for"
"""Why a place gives no sample."""

_TRIES = 8
"""Draws of a place before it is left out."""


@dataclass(frozen=True)
class Place:
    """Where the car is at a time, in the world of a log, and how that differs from the recorded path."""

    time_s: float
    world_from_ego: Float[np.ndarray, "4 4"]
    aside_m: float
    turned_rad: float


def draw_places(
    log: Log, span_s: tuple[float, float], count: int, options: PathOptions, seed: int
) -> tuple[list[Place], int]:
    """Places along the recorded path and beside it, at times that are spread evenly, and how many were near.

    A place that is as good as an earlier one is drawn again some times, and then left out.
    """
    rng = np.random.default_rng(seed)
    path = Trajectory(log.world_from_ego, log.times_s)
    places: list[Place] = []
    near = 0
    edges = np.linspace(*span_s, count + 1)
    for start, end in pairwise(edges.tolist()):
        for _ in range(_TRIES):
            place = _drawn(path, float(rng.uniform(start, end)), options, rng)
            if all(_apart(place, other, options) for other in places):
                places.append(place)
                break
        else:
            near += 1
    return places, near


def span_of(scene: Scene, log: Log) -> tuple[float, float]:
    """Times that both the scene and the labels of its log know, on the clock of the log."""
    start = _link(scene, log).start_s
    first = max(float(log.times_s[0]), start + float(scene.times_s.min()))
    last = min(float(log.times_s[-1]), start + float(scene.times_s.max()))
    if last <= first:
        raise InputError(f"{log.name}: its labels and the scene have no time in common")
    return first, last


def samples_of_scene(
    scene: Scene,
    log: Log,
    places: list[Place],
    image: ImageSize,
    grid: BevGrid,
    options: PathOptions,
    first: int = 0,
) -> Iterator[tuple[SampleNote, BevSample] | str]:
    """Render the cameras of the log at each place; where that gives no sample, say why.

    Of a scene whose street was drawn level, car and boxes stand on that street. Names of samples count from
    ``first``.

    Raises:
        InputError: The scene was made of another drive, or the drive has no map; or trust is asked for, and
            the scene does not know how far it is off its frames.
    """
    link = _link(scene, log)
    map = road_map(log)
    scene_from_log = np.linalg.inv(np.array(link.log_from_world))
    if link.level_z_m is not None:
        log, places = _on_level(log, places, link.level_z_m)
    cameras = in_order(log)
    pinholes = [_pinhole(camera, image) for camera in cameras]
    trust = None if options.least_psnr_db is None else SceneTrust.of(scene)
    least_db = options.least_psnr_db if options.least_psnr_db is not None else -np.inf
    for number, place in enumerate(places, first):
        rig = [
            pinhole.at(scene_from_log @ place.world_from_ego @ camera.ego_from_camera)
            for camera, pinhole in zip(cameras, pinholes, strict=True)
        ]
        if trust is not None and _expected_db(trust, rig, place.time_s - link.start_s) < least_db:
            yield TOO_DOUBTFUL
        else:
            yield _sample(scene, log, map, link, rig, cameras, pinholes, place, number, grid, options)


def _expected_db(trust: SceneTrust, rig: list[Camera], t_s: float) -> float:
    """PSNR to expect, the mean over the pictures of all cameras."""
    return float(np.mean([trust.view(camera, t_s).psnr_db for camera in rig]))


def _sample(
    scene: Scene,
    log: Log,
    map: LogMap,
    link: OfLog,
    rig: list[Camera],
    cameras: list[LogCamera],
    pinholes: list[Camera],
    place: Place,
    number: int,
    grid: BevGrid,
    options: PathOptions,
) -> tuple[SampleNote, BevSample] | str:
    pictures: list[UInt8[np.ndarray, "3 h w"]] = []
    views: list[View] = []
    covered: list[float] = []
    time_s = place.time_s - link.start_s
    moment = moment_of(scene, time_s)
    for camera, pinhole, at in zip(cameras, pinholes, rig, strict=True):
        view = render_scene(scene, at, time_s, moment=moment)
        alpha = view.alpha.numpy()
        covered.append(float(alpha[_below_horizon(pinhole.at(camera.ego_from_camera))].mean()))
        pictures.append(view.picture.transpose(2, 0, 1))
        views.append((pinhole.at(place.world_from_ego @ camera.ego_from_camera), view.seen_depth_m))
    if np.mean(covered) < options.least_covered:
        return TOO_LITTLE
    boxes = _boxes(log, place, views)
    extrinsics = [
        camera_from_level_ego(place.world_from_ego @ camera.ego_from_camera, place.world_from_ego)
        for camera in cameras
    ]
    k = np.stack([each.index_matrix for each in pinholes])
    sample = BevSample(
        np.stack(pictures),
        k.astype(np.float32),
        np.stack(extrinsics),
        bev_labels(grid, place.world_from_ego, boxes, map),
    )
    note = note_of(
        f"{log.name}-rendered-{number:04d}",
        log.name,
        place.time_s,
        place.world_from_ego,
        kind="rendered",
        aside_m=place.aside_m,
        turned_rad=place.turned_rad,
        covered=float(np.mean(covered)),
        boxes=len(boxes),
        cameras=cameras_of([each.name for each in cameras], sample.pixel_from_camera, sample.camera_from_ego),
        prior=scene.provenance.prior,
    )
    return note, sample


def _link(scene: Scene, log: Log) -> OfLog:
    link = scene.provenance.log
    if link is None or link.name != log.name:
        of = "no drive of a data set" if link is None else link.name
        raise InputError(f"the scene was made of {of}, the labels are of {log.name}; give those of its drive")
    return link


def _on_level(log: Log, places: list[Place], z_m: float) -> tuple[Log, list[Place]]:
    """The boxes of a log and places of its car, upright on a level road of a height."""
    boxes = tuple(
        replace(each, world_from_box=_upright(each.world_from_box, z_m + each.size_lwh_m[:, 2] / 2))
        for each in log.boxes
    )
    stood = [replace(each, world_from_ego=_upright(each.world_from_ego, np.array(z_m))) for each in places]
    return replace(log, boxes=boxes), stood


def _upright(poses: Float[np.ndarray, "*n 4 4"], z_m: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n 4 4"]:
    """Poses of the same places in the plane and the same headings, at heights."""
    yaw = np.arctan2(poses[..., 1, 0], poses[..., 0, 0])
    made = np.zeros_like(poses)
    made[..., 0, 0] = made[..., 1, 1] = np.cos(yaw)
    made[..., 1, 0] = np.sin(yaw)
    made[..., 0, 1] = -made[..., 1, 0]
    made[..., 2, 2] = made[..., 3, 3] = 1
    made[..., :2, 3], made[..., 2, 3] = poses[..., :2, 3], z_m
    return made


def _drawn(path: Trajectory, time_s: float, options: PathOptions, rng: np.random.Generator) -> Place:
    aside_m = float(rng.uniform(-options.aside_m, options.aside_m))
    turned_rad = float(np.deg2rad(rng.uniform(-options.turned_deg, options.turned_deg)))
    moved = np.eye(4)
    c, s = np.cos(turned_rad), np.sin(turned_rad)
    moved[:2, :2] = [[c, -s], [s, c]]
    moved[1, 3] = aside_m
    return Place(time_s, path.at(np.array([time_s]))[0] @ moved, aside_m, turned_rad)


def _apart(one: Place, other: Place, options: PathOptions) -> bool:
    """Whether two places differ enough in place, direction or time."""
    away_m = np.linalg.norm(one.world_from_ego[:3, 3] - other.world_from_ego[:3, 3])
    cosine = one.world_from_ego[:3, 0] @ other.world_from_ego[:3, 0]
    turned_deg = np.rad2deg(np.arccos(np.clip(cosine, -1, 1)))
    away_s = abs(one.time_s - other.time_s)
    return bool(away_m >= options.apart_m or turned_deg >= options.apart_deg or away_s >= options.apart_s)


def _pinhole(camera: LogCamera, image: ImageSize) -> Camera:
    """A camera whose pictures are as ``prepare_picture`` would make them."""
    height = image.height_px + image.cropped_px
    k = camera.pinhole.index_matrix
    k[0] *= image.width_px / camera.pinhole.width_px
    k[1] *= height / camera.pinhole.height_px
    cx, cy = k[0, 2] + 0.5, k[1, 2] + 0.5 - image.cropped_px
    return Camera(k[0, 0], k[1, 1], cx, cy, image.width_px, image.height_px)


def _below_horizon(camera: Camera) -> Bool[np.ndarray, "h w"]:
    """Pixels that look down, of a camera in the ego frame; all of them where none does."""
    below = camera.rays() @ camera.world_from_camera[2, :3] < 0
    return below if below.any() else np.ones_like(below)


def _boxes(log: Log, place: Place, views: list[View]) -> list[Annotation]:
    """Boxes near the car, as visible as the views show them."""
    found: list[Annotation] = []
    for track, pose in boxes_at(log, place.time_s):
        if np.linalg.norm(pose[:2, 3] - place.world_from_ego[:2, 3]) < NEAR_M:
            corners = box_corners(pose, track.size_lwh_m[track.row_at(place.time_s)])
            found.append(
                annotation_of(track, pose, place.time_s, level_of(share_seen(corners, views, RECONSTRUCTED)))
            )
    return found
