"""Structure from motion of one camera with pycolmap, one thread, seeded."""

import signal
import threading
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.evidence import Features
from dreamdrive.scene.camera import Camera

OVERLAP = 5
MATCH_ERROR_PX_AT_640 = 1.5
FILTER_ERROR_PX = 2.0
FILTER_ANGLE_DEG = 0.5
ROBUST_SCALE_PX = 1.0


@dataclass(frozen=True)
class SparseModel:
    """A sparse reconstruction of a clip, in arbitrary units."""

    world_from_camera: Float[np.ndarray, "f 4 4"]  # NaN where a frame was not registered
    points: Float[np.ndarray, "p 3"]
    seen: Bool[np.ndarray, "f p"]  # which frame sees which point
    lens: Float[np.ndarray, "5"]  # focal lengths and principal point in working pixels; radial term k
    cost: float  # mean robust (Cauchy, 1 px) cost of an observation
    reprojection_px: float  # mean
    native: Any  # pycolmap's own reconstruction

    @property
    def registered(self) -> Bool[np.ndarray, " f"]:
        """Frames with a pose."""
        return np.isfinite(self.world_from_camera[:, 0, 0])


@cache
def _colmap() -> Any:
    """The module pycolmap; loaded at first use, as cameras that are known need none of it.

    It puts a handler in place by which a request to terminate prints the stack and dies: ours comes back.
    """
    ours = signal.getsignal(signal.SIGTERM)
    import pycolmap

    if callable(ours) and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, ours)
    return pycolmap


def match(database: Path, features: Sequence[Features], camera: Camera, seed: int) -> None:
    """Write features, pair matches and two-view geometries into a new COLMAP database.

    Features are in order of time; pairs are verified with the pinhole of the working size.
    """
    with _quiet(), _colmap().Database.open(str(database)) as store:
        native = _native_camera(camera)
        store.write_camera(native, use_camera_id=True)
        rig = _colmap().Rig(rig_id=1)
        rig.add_ref_sensor(native.sensor_id)
        store.write_rig(rig, use_rig_id=True)
        for index, found in enumerate(features):
            image = _colmap().Image(name=f"{index:05d}", camera_id=1, image_id=index + 1)
            store.write_image(image, use_image_id=True)
            frame = _colmap().Frame(frame_id=index + 1, rig_id=1)
            frame.add_data_id(image.data_id)
            store.write_frame(frame, use_frame_id=True)
            store.write_keypoints(index + 1, found.keypoints_px)
            store.write_descriptors(
                index + 1,
                _colmap().FeatureDescriptors(_colmap().FeatureExtractorType.SIFT, found.descriptors),
            )
    _verify_pairs(database, camera, seed)


def rematch(database: Path, camera: Camera, seed: int) -> None:
    """Verify the stored pair matches again with another camera."""
    with _quiet(), _colmap().Database.open(str(database)) as store:
        store.update_camera(_native_camera(camera))
        store.clear_two_view_geometries()
    _verify_pairs(database, camera, seed)


def map_globally(database: Path, count: int, seed: int) -> SparseModel | None:
    """Global mapping (GLOMAP, Pan et al. 2024) at a fixed focal length, then robust bundle adjustment.

    It starts at random positions of the seed. The largest model, or None when no model comes out.
    """
    options = _colmap().GlobalPipelineOptions()
    options.num_threads = 1
    options.random_seed = seed
    mapper = options.mapper
    mapper.num_threads = 1
    mapper.random_seed = seed
    mapper.bundle_adjustment.refine_focal_length = False
    mapper.bundle_adjustment.refine_extra_params = False
    mapper.bundle_adjustment.ceres.solver_options.num_threads = 1
    mapper.global_positioning.use_gpu = False
    return _largest(_colmap().global_mapping, database, options, count)


def map_incrementally(database: Path, count: int, seed: int) -> SparseModel | None:
    """Incremental mapping with the thresholds of a forward drive; the second choice."""
    options = _colmap().IncrementalPipelineOptions()
    options.num_threads = 1
    options.random_seed = seed
    options.multiple_models = False
    options.ba_refine_focal_length = False
    options.ba_refine_extra_params = False
    options.extract_colors = False
    mapper = options.mapper
    mapper.init_max_forward_motion = 1.0
    mapper.init_min_tri_angle = 2.0
    mapper.filter_min_tri_angle = 1.0
    mapper.abs_pose_max_error = 4.0
    mapper.filter_max_reproj_error = 2.0
    mapper.abs_pose_refine_focal_length = False
    mapper.abs_pose_refine_extra_params = False
    return _largest(_colmap().incremental_mapping, database, options, count)


def adjust(
    model: SparseModel,
    focal_px: float | None = None,
    free_focal: bool = False,
    free_radial: bool = False,
    drop_outliers: bool = True,
) -> SparseModel:
    """Robust bundle adjustment of a copy of the model, from another focal length if one is given.

    The focal length and a radial term k (x (1 + k r^2)) are adjusted where free. Dropping outliers adjusts
    twice and drops poor observations after each; otherwise it is done once, briefly, and all are kept, so
    that costs can be compared.
    """
    native = _colmap().Reconstruction(model.native)
    lens = model.lens.copy()
    if focal_px is not None:
        lens[:2] = focal_px
    camera = native.cameras[1]
    if free_focal or free_radial or lens[4] != 0:
        camera.model = _colmap().CameraModelId.SIMPLE_RADIAL
        camera.params = [float(lens[:2].mean()), *lens[2:].tolist()]
    else:
        camera.params = lens[:4].tolist()
    _adjust_in_place(native, free_focal, free_radial, drop_outliers)
    return _read(native, len(model.world_from_camera))


def _native_camera(camera: Camera) -> Any:
    native = _colmap().Camera(
        model="PINHOLE",
        width=camera.width_px,
        height=camera.height_px,
        params=[camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px],
        camera_id=1,
    )
    native.has_prior_focal_length = True
    return native


def _verify_pairs(database: Path, camera: Camera, seed: int) -> None:
    matching = _colmap().FeatureMatchingOptions()
    matching.num_threads = 1
    matching.use_gpu = False
    pairing = _colmap().SequentialPairingOptions()
    pairing.overlap = OVERLAP
    pairing.quadratic_overlap = True
    pairing.num_threads = 1
    verification = _colmap().TwoViewGeometryOptions()
    verification.detect_watermark = False
    verification.ransac.max_error = MATCH_ERROR_PX_AT_640 * camera.width_px / 640
    verification.ransac.random_seed = seed
    with _quiet():
        _colmap().match_sequential(
            database,
            matching_options=matching,
            pairing_options=pairing,
            verification_options=verification,
            device=_colmap().Device.cpu,
        )


def _largest(
    run: Callable[..., dict[int, Any]], database: Path, options: Any, count: int
) -> SparseModel | None:
    output = database.parent / "models"
    output.mkdir(exist_ok=True)
    with _quiet():
        models = run(database, database.parent, output, options=options)
    found = [model for model in models.values() if model.num_points3D() > 0]
    if not found:
        return None
    native = max(found, key=lambda model: (model.num_reg_images(), model.num_points3D()))
    _adjust_in_place(native, free_focal=False, free_radial=False, drop_outliers=True)
    return _read(native, count)


def _adjust_in_place(native: Any, free_focal: bool, free_radial: bool, drop_outliers: bool) -> None:
    options = _colmap().BundleAdjustmentOptions()
    options.refine_focal_length = free_focal
    options.refine_extra_params = free_radial
    options.print_summary = False
    options.ceres.loss_function_type = _colmap().LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = ROBUST_SCALE_PX
    options.ceres.solver_options.num_threads = 1
    options.ceres.solver_options.max_num_iterations = 100 if drop_outliers else 25
    options.ceres.solver_options.function_tolerance = 1e-7
    with _quiet():
        for _ in range(2 if drop_outliers else 1):
            config = _colmap().BundleAdjustmentConfig()
            for image in native.reg_image_ids():
                config.add_image(image)
            config.fix_gauge(_colmap().BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
            _colmap().create_default_bundle_adjuster(options, config, native).solve()
            if drop_outliers:
                _colmap().ObservationManager(native).filter_all_points3D(FILTER_ERROR_PX, FILTER_ANGLE_DEG)
        native.update_point_3d_errors()


@contextmanager
def _quiet() -> Generator[None, None, None]:
    """Keep COLMAP's own log off the terminal; what matters is returned."""
    level = _colmap().logging.minloglevel
    _colmap().logging.minloglevel = 3
    try:
        yield
    finally:
        _colmap().logging.minloglevel = level


def _read(native: Any, count: int) -> SparseModel:
    poses = np.full((count, 4, 4), np.nan)
    pixels: dict[int, np.ndarray] = {}
    for image in native.images.values():
        if image.has_pose:
            pose = np.eye(4)
            pose[:3] = image.cam_from_world().inverse().matrix()
            poses[int(image.name)] = pose
            pixels[image.image_id] = np.array([point.xy for point in image.points2D])
    identifiers = sorted(native.points3D.keys())
    points = np.array([native.points3D[identifier].xyz for identifier in identifiers]).reshape(-1, 3)
    frame, column, pixel = [], [], []
    for index, identifier in enumerate(identifiers):
        for element in native.points3D[identifier].track.elements:
            frame.append(element.image_id - 1)
            column.append(index)
            pixel.append(pixels[element.image_id][element.point2D_idx])
    seen = np.zeros((count, len(identifiers)), bool)
    seen[frame, column] = True
    lens = _lens(native.cameras[1])
    error = _errors_px(poses[frame], points[column], np.array(pixel).reshape(-1, 2), lens)
    cost = ROBUST_SCALE_PX**2 * np.log1p((error / ROBUST_SCALE_PX) ** 2)
    mean = (float(cost.mean()), float(error.mean())) if len(error) else (0.0, 0.0)
    return SparseModel(poses, points, seen, lens, *mean, native)


def _lens(camera: Any) -> np.ndarray:
    radial = camera.params[3] if camera.model == _colmap().CameraModelId.SIMPLE_RADIAL else 0.0
    focal = camera.focal_length_x, camera.focal_length_y
    return np.array([*focal, camera.principal_point_x, camera.principal_point_y, radial])


def _errors_px(poses: np.ndarray, points: np.ndarray, pixels: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """Reprojection errors (N,) of points (N, 3) seen from world_from_camera poses (N, 4, 4)."""
    local = np.einsum("nji,nj->ni", poses[:, :3, :3], points - poses[:, :3, 3])
    plane = local[:, :2] / local[:, 2:]
    plane = plane * (1 + lens[4] * (plane**2).sum(1, keepdims=True))
    return np.linalg.norm(plane * lens[:2] + lens[2:4] - pixels, axis=1)
