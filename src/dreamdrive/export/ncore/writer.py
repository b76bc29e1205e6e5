"""Logs as sequences of NVIDIA NCore V4.

A sequence is a folder with ``sequence.json``, which readers are given, an archive for each sensor and one for
all else. Its world is the car at its first time: x ahead, y left, z up, in metres. Pictures are stored as
they are, each as taken at one moment by a pinhole. NCore counts pixels as we do, from the picture's corner.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace as replace_fields
from pathlib import Path
from types import MappingProxyType

import numpy as np
from jaxtyping import Bool, Float, Int
from PIL import Image

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.errors import InputError
from dreamdrive.export.log_parts import path_of, picture_of, stamps
from dreamdrive.export.ncore.words import RIG, WORLD, Origin, cuboids_of, model_of, need_ncore, rigid
from dreamdrive.files.json_file import write_json
from dreamdrive.files.kinds import NCORE_KIND
from dreamdrive.files.output import new_folder, plain_name
from dreamdrive.scene.street.log import LidarSweep, Log, LogCamera
from dreamdrive.scene.trajectory import Trajectory

MARK = "sequence.json"
LIDAR = "LIDAR_TOP"
HIDDEN = "ego"
"""Readers leave out what a mask of this name covers: in NCore, the car itself."""
Masks = Mapping[str, Bool[np.ndarray, "h w"]]
"""What of a camera's pictures others shall leave out, by its name."""
NO_MASKS: Masks = MappingProxyType({})
Points = Callable[[Path], Float[np.ndarray, "n 3"]]
_DEFAULT = "default"
"""The components that readers open where nothing else is said."""
_RIGID = 1e-6
"""Metres, and entries of a rotation, by which a sensor may move on the car and still counts as fixed."""


def write_ncore(
    log: Log,
    folder: Path,
    *,
    origin: Origin = "EXTERNAL",
    hidden: Masks = NO_MASKS,
    points: Points = read_points,
    replace: bool = False,
) -> None:
    """Write a drive; the folder appears whole or not at all.

    Each picture keeps its pose to a micrometre: a camera that is fixed to the car has a mounting, another
    one is placed on the car anew in each picture. In between the car goes straight on. Sweeps outside of
    the time of the pictures are left out; the intensity of points is not known, and 0. NCore has no maps.

    Args:
        log: The drive.
        folder: To write.
        origin: Where its boxes come from.
        hidden: What others shall leave out.
        points: Reads the points of a sweep's file.
        replace: Take the place of an older folder of this kind.

    Raises:
        InputError: The package is missing, a picture is not of its pinhole's size, or there is one time only.
    """
    need_ncore()
    hidden = {plain_name(name): mask for name, mask in hidden.items()}
    plain = tuple(replace_fields(camera, name=plain_name(camera.name)) for camera in log.cameras)
    log = replace_fields(log, name=plain_name(log.name), cameras=plain)
    with new_folder(folder, replace=replace, kind=NCORE_KIND) as made:
        writer = _Writer(log, made)
        for camera in log.cameras:
            writer.camera(camera, hidden.get(camera.name))
        writer.lidar(points)
        writer.boxes(origin)
        writer.finish()


class _Writer:
    """One drive on its way into a folder."""

    def __init__(self, log: Log, folder: Path) -> None:
        from ncore.data.v4 import (
            IntrinsicsComponent,
            MasksComponent,
            PosesComponent,
            SequenceComponentGroupsWriter,
        )
        from ncore.impl.common.transformations import HalfClosedInterval
        from upath import UPath

        self.log, self.folder = log, folder
        self.times_us, log_from_rig = path_of(log)
        if len(self.times_us) < 2:
            raise InputError(
                f"{log.name} has pictures of one time only; NCore wants a path, of two times or more"
            )
        self.world_from_log = np.linalg.inv(log_from_rig[0])
        self.world_from_rig = rigid(self.world_from_log @ log_from_rig)
        first, last = self.times_us[[0, -1]].tolist()
        self.sequence = SequenceComponentGroupsWriter(
            output_dir_path=UPath(folder),
            store_base_name=log.name,
            sequence_id=log.name,
            sequence_timestamp_interval_us=HalfClosedInterval.from_start_end(first, last),
            generic_meta_data={"about": log.about, "log_from_world": log_from_rig[0].tolist()},
        )
        self.poses = self.sequence.register_component_writer(PosesComponent.Writer, _DEFAULT)
        self.intrinsics = self.sequence.register_component_writer(IntrinsicsComponent.Writer, _DEFAULT)
        self.masks = self.sequence.register_component_writer(MasksComponent.Writer, _DEFAULT)
        self.poses.store_dynamic_pose(RIG, WORLD, self.world_from_rig, self.times_us.astype(np.uint64))
        # Where on the globe is not known, and some readers ask for it.
        self.poses.store_static_pose(WORLD, "world_global", np.eye(4))

    def camera(self, camera: LogCamera, hidden: Bool[np.ndarray, "h w"] | None) -> None:
        """Pictures, pinhole, place on the car and mask of a camera."""
        from ncore.data.v4 import CameraSensorComponent

        times_us = stamps(self.log, camera.times_s)
        self._place(camera.name, times_us, camera.world_from_camera)
        self.intrinsics.store_camera_intrinsics(camera.name, model_of(camera.pinhole))
        masks = {} if hidden is None else {HIDDEN: Image.fromarray(np.where(hidden, 255, 0).astype(np.uint8))}
        self.masks.store_camera_masks(camera.name, masks)
        frames = self.sequence.register_component_writer(
            CameraSensorComponent.Writer, camera.name, group_name=camera.name
        )
        for file, time_us in zip(camera.files, times_us, strict=True):
            data, kind = picture_of(file, camera.pinhole)
            frames.store_frame(data, kind, np.array([time_us, time_us], np.uint64), {}, {})

    def lidar(self, points: Points) -> None:
        """Sweeps as rays of a lidar; where the log has points in the world alone, as points there."""
        times_us = stamps(self.log, np.array([sweep.time_s for sweep in self.log.sweeps]))
        first, last = self.times_us[[0, -1]]
        sweeps = [
            (sweep, time_us)
            for sweep, time_us in zip(self.log.sweeps, times_us.tolist(), strict=True)
            if first <= time_us <= last
        ]
        if not sweeps:
            return
        if all(np.array_equal(sweep.world_from_points, np.eye(4)) for sweep, _ in sweeps):
            self._points(sweeps, points)
        else:
            self._rays(sweeps, points)

    def _rays(self, sweeps: Sequence[tuple[LidarSweep, int]], points: Points) -> None:
        from ncore.data.v4 import LidarSensorComponent

        times_us = np.array([time_us for _, time_us in sweeps])
        self._place(LIDAR, times_us, np.stack([sweep.world_from_points for sweep, _ in sweeps]))
        frames = self.sequence.register_component_writer(LidarSensorComponent.Writer, LIDAR, group_name=LIDAR)
        for sweep, time_us in sweeps:
            local = points(sweep.file)
            local = local[local.any(axis=1)]  # a point at the lidar itself has no direction
            away_m = np.linalg.norm(local, axis=1)
            frames.store_frame(
                direction=(local / away_m[:, None]).astype(np.float32),
                timestamp_us=np.full(len(local), time_us, np.uint64),
                model_element=None,
                distance_m=away_m[None].astype(np.float32),
                intensity=np.zeros((1, len(local)), np.float32),
                frame_timestamps_us=np.array([time_us, time_us], np.uint64),
                generic_data={},
                generic_meta_data={},
            )

    def _points(self, sweeps: Sequence[tuple[LidarSweep, int]], points: Points) -> None:
        from ncore.data import PointCloud
        from ncore.data.v4 import PointCloudsComponent

        clouds = self.sequence.register_component_writer(
            PointCloudsComponent.Writer,
            LIDAR,
            group_name=LIDAR,
            coordinate_unit=PointCloud.CoordinateUnit.METERS,
        )
        rotation, step = self.world_from_log[:3, :3], self.world_from_log[:3, 3]
        for sweep, time_us in sweeps:
            clouds.store_pc((points(sweep.file) @ rotation.T + step).astype(np.float32), WORLD, time_us)

    def boxes(self, origin: Origin) -> None:
        """All boxes, in the world."""
        from ncore.data.v4 import CuboidsComponent

        cuboids = self.sequence.register_component_writer(CuboidsComponent.Writer, _DEFAULT)
        cuboids.store_observations(
            [
                each
                for track in self.log.boxes
                for each in cuboids_of(self.log, track, self.world_from_log, origin)
            ]
        )

    def _place(
        self, name: str, times_us: Int[np.ndarray, " n"], log_from_sensor: Float[np.ndarray, "n 4 4"]
    ) -> None:
        """Where a sensor is on the car: for all times where it is fixed there, else at each."""
        path = Trajectory(self.world_from_rig, (self.times_us - self.times_us[0]) / 1e6)
        world_from_rig = path.at((times_us - self.times_us[0]) / 1e6)
        placed = rigid(np.linalg.inv(world_from_rig) @ self.world_from_log @ log_from_sensor)
        if np.ptp(placed, axis=0).max() < _RIGID:
            self.poses.store_static_pose(name, RIG, placed[0])
        else:
            self.poses.store_dynamic_pose(
                name, RIG, placed, times_us.astype(np.uint64), require_sequence_time_coverage=False
            )

    def finish(self) -> None:
        """Close the archives, and tell readers of them."""
        from ncore.data.v4 import SequenceComponentGroupsReader

        about = SequenceComponentGroupsReader(self.sequence.finalize()).get_sequence_meta()
        # They are opened at the same time, and come in any order.
        about.component_stores.sort(key=lambda store: store.path)
        write_json(self.folder / MARK, about.to_dict())
