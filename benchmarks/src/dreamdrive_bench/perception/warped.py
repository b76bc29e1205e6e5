"""New views of recorded pictures without a scene: the road as a plane, all else as far away."""

from collections.abc import Iterator

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.data.pictures.images import read_image
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.log import Log
from dreamdrive.tasks.perception import (
    BevGrid,
    BevSample,
    ImageSize,
    PathOptions,
    SampleNote,
    annotation_of,
    bev_labels,
    boxes_at,
    camera_from_level_ego,
    cameras_of,
    draw_places,
    in_order,
    note_of,
    prepare_picture,
    road_map,
)

_FAR_M = 60.0
"""Road that is farther moves as what is far away does."""


def warped_samples(
    log: Log, count: int, image: ImageSize, grid: BevGrid, options: PathOptions, seed: int
) -> Iterator[tuple[SampleNote, BevSample]]:
    """As many samples as of a scene, at places drawn alike, but each at the nearest labelled time."""
    span = float(log.times_s[0]), float(log.times_s[-1])
    map = road_map(log)
    cameras = in_order(log)
    for number, drawn in enumerate(draw_places(log, span, count, options, seed)[0]):
        step = int(np.abs(log.times_s - drawn.time_s).argmin())
        time_s = float(log.times_s[step])
        moved = np.eye(4)
        c, s = np.cos(drawn.turned_rad), np.sin(drawn.turned_rad)
        moved[:2, :2], moved[1, 3] = [[c, -s], [s, c]], drawn.aside_m
        ego = log.world_from_ego[step] @ moved
        pictures, intrinsics, extrinsics = [], [], []
        for camera in cameras:
            row = int(np.abs(camera.times_s - time_s).argmin())
            pose = ego @ camera.ego_from_camera
            source = camera.pinhole.at(camera.world_from_camera[row])
            picture = warp(read_image(camera.files[row]).rgb, source, camera.pinhole.at(pose), ego[2, 3])
            k = camera.pinhole.index_matrix
            picture, k = prepare_picture(picture, k, image)
            pictures.append(picture)
            intrinsics.append(k)
            extrinsics.append(camera_from_level_ego(pose, ego))
        boxes = [annotation_of(track, pose, time_s) for track, pose in boxes_at(log, time_s)]
        labels = bev_labels(grid, ego, boxes, map)
        sample = BevSample(np.stack(pictures), np.stack(intrinsics), np.stack(extrinsics), labels)
        note = note_of(
            f"{log.name}-warped-{number:04d}",
            log.name,
            time_s,
            ego,
            kind="rendered",
            aside_m=drawn.aside_m,
            turned_rad=drawn.turned_rad,
            covered=1.0,
            boxes=len(boxes),
            cameras=cameras_of(
                [each.name for each in cameras], sample.pixel_from_camera, sample.camera_from_ego
            ),
        )
        yield note, sample


def warp(
    picture: UInt8[np.ndarray, "h w 3"], source: Camera, target: Camera, ground_z_m: float
) -> UInt8[np.ndarray, "h w 3"]:
    """A picture as another camera would see it; the world has z up, its road lies at a height."""
    rays = target.rays() @ target.world_from_camera[:3, :3].T
    eye = target.world_from_camera[:3, 3]
    down = np.minimum(rays[..., 2], -1e-6)
    reach = np.where(rays[..., 2] < 0, (ground_z_m - eye[2]) / down, np.inf)
    away_m = reach * np.linalg.norm(rays[..., :2], axis=2)
    points = np.where((away_m < _FAR_M)[..., None], eye + np.minimum(reach, 1e4)[..., None] * rays, np.nan)
    towards = np.where(np.isnan(points), rays, points - source.world_from_camera[:3, 3])
    local = towards @ source.world_from_camera[:3, :3]
    return _sampled(picture, source, local)


def _sampled(
    picture: UInt8[np.ndarray, "h w 3"], source: Camera, local: Float[np.ndarray, "h w 3"]
) -> UInt8[np.ndarray, "h w 3"]:
    z = np.maximum(local[..., 2], 1e-3)
    u = (source.fx_px * local[..., 0] / z + source.cx_px - 0.5).astype(np.float32)
    v = (source.fy_px * local[..., 1] / z + source.cy_px - 0.5).astype(np.float32)
    return np.asarray(
        cv2.remap(picture, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), dtype=np.uint8
    )
