"""Drives as messages of Foxglove.

Frames are called as Foxglove's 3D panel expects them, and topics as in its own conversion of nuScenes, so
that layouts made for that fit.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.export.log import RigCamera
from dreamdrive.export.log_parts import NS
from dreamdrive.scene.camera import Camera, check_rigid
from dreamdrive.scene.street.log import word_of

if TYPE_CHECKING:
    from foxglove import messages

MAP, CAR = "map", "base_link"
"""Frames: the world, and the car, which the 3D panel follows by itself. Those of cameras have their names."""
TRANSFORMS, BOXES, PATH, LIDAR = "/tf", "/markers/annotations", "/markers/path", "/LIDAR_TOP"
_COLOURS = {"vehicle.car": "4696ff", "vehicle": "ffa028", "human": "ff465a"}
"""Of boxes, by the beginning of their kind: red, green and blue."""
_OTHER, _PLANNED = "b4b4b4", "1acc4d"
_SHEER = 0.5
"""Opacity of boxes: pictures below them can be seen."""
_LINE_M = 0.15


@dataclass(frozen=True)
class RecordedBox:
    """A road user at one time.

    Attributes:
        name: Of no other at that time.
        kind: In the words of nuScenes, such as ``vehicle.car``, or any other.
        world_from_box: The origin is the middle of the box; x ahead, y left, z up.
        size_lwh_m: Length, width and height.
    """

    name: str
    kind: str
    world_from_box: Float[np.ndarray, "4 4"]
    size_lwh_m: Float[np.ndarray, "3"]

    def __post_init__(self) -> None:
        check_rigid(self.world_from_box, f"box {self.name}")


def image_topic(camera: str) -> str:
    """Where the pictures of a camera are."""
    return f"/{camera}/image_rect_compressed"


def calibration_topic(camera: str) -> str:
    """Where its calibration is: beside its pictures, where the image panel looks for it."""
    return f"/{camera}/camera_info"


def number_topic(name: str) -> str:
    """Where a number is; what is plotted is its ``value``."""
    return f"/numbers/{name}"


def calibration_of(time_ns: int, name: str, pinhole: Camera) -> "messages.CameraCalibration":
    """The pinhole, without distortion. Foxglove counts pixels as we do, from the picture's corner."""
    from foxglove.messages import CameraCalibration

    matrix = pinhole.matrix
    return CameraCalibration(
        timestamp=_time(time_ns),
        frame_id=name,
        width=pinhole.width_px,
        height=pinhole.height_px,
        distortion_model="plumb_bob",
        D=[0.0] * 5,
        K=matrix.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=np.column_stack([matrix, np.zeros(3)]).ravel().tolist(),
    )


def transforms_of(
    time_ns: int, world_from_ego: Float[np.ndarray, "4 4"], cameras: Sequence[RigCamera]
) -> "messages.FrameTransforms":
    """Where the car is in the world, and all its cameras on it: whoever seeks finds all in one message."""
    from foxglove.messages import FrameTransform, FrameTransforms, Quaternion, Vector3

    placed = [(MAP, CAR, world_from_ego), *((CAR, each.name, each.ego_from_camera) for each in cameras)]
    return FrameTransforms(
        transforms=[
            FrameTransform(
                timestamp=_time(time_ns),
                parent_frame_id=parent,
                child_frame_id=child,
                translation=Vector3(**_xyz(pose[:3, 3])),
                rotation=Quaternion(**_turn(pose)),
            )
            for parent, child, pose in placed
        ]
    )


def boxes_of(time_ns: int, boxes: Sequence[RecordedBox]) -> "messages.SceneUpdate":
    """All boxes of a time, in place of all of before: whoever seeks finds all in one message."""
    from foxglove.messages import CubePrimitive, KeyValuePair, SceneEntity, SceneUpdate, Vector3

    def entity(box: RecordedBox) -> SceneEntity:
        cube = CubePrimitive(
            pose=_pose(box.world_from_box),
            size=Vector3(**_xyz(box.size_lwh_m)),
            color=_colour(word_of(box.kind, _COLOURS) or _OTHER, _SHEER),
        )
        return SceneEntity(
            timestamp=_time(time_ns),
            frame_id=MAP,
            id=box.name,
            metadata=[KeyValuePair(key="category", value=box.kind)],
            cubes=[cube],
        )

    return SceneUpdate(deletions=[_all_before(time_ns)], entities=[entity(box) for box in boxes])


def line_of(time_ns: int, points_m: Float[np.ndarray, "n 3"]) -> "messages.SceneUpdate":
    """A line through points of the world, in place of the one before; none where there are no points."""
    from foxglove.messages import LinePrimitive, Point3, SceneEntity, SceneUpdate

    line = LinePrimitive(
        pose=_pose(np.eye(4)),
        thickness=_LINE_M,
        points=[Point3(**_xyz(point)) for point in points_m],
        color=_colour(_PLANNED, 1.0),
    )
    entity = SceneEntity(timestamp=_time(time_ns), frame_id=MAP, id="path", lines=[line])
    return SceneUpdate(deletions=[_all_before(time_ns)], entities=[entity] if len(points_m) else [])


def cloud_of(
    time_ns: int, points_m: Float[np.ndarray, "n 3"], world_from_points: Float[np.ndarray, "4 4"]
) -> "messages.PointCloud":
    """Points in their own frame, such as the lidar's, and where that was."""
    from foxglove.messages import PackedElementField, PackedElementFieldNumericType, PointCloud

    single = PackedElementFieldNumericType.Float32
    return PointCloud(
        timestamp=_time(time_ns),
        frame_id=MAP,
        pose=_pose(world_from_points),
        point_stride=12,
        fields=[PackedElementField(name=axis, offset=4 * k, type=single) for k, axis in enumerate("xyz")],
        data=points_m.astype("<f4").tobytes(),
    )


def image_of(time_ns: int, camera: str, data: bytes, kind: str) -> "messages.CompressedImage":
    """A picture as it is in a file of a kind: jpeg, png or webp."""
    from foxglove.messages import CompressedImage

    return CompressedImage(timestamp=_time(time_ns), frame_id=camera, data=data, format=kind)


def _all_before(time_ns: int) -> "messages.SceneEntityDeletion":
    from foxglove.messages import SceneEntityDeletion, SceneEntityDeletionType

    return SceneEntityDeletion(timestamp=_time(time_ns), type=SceneEntityDeletionType.All)


def _time(time_ns: int) -> "messages.Timestamp":
    from foxglove.messages import Timestamp

    return Timestamp(time_ns // NS, time_ns % NS)


def _colour(hex_rgb: str, opacity: float) -> "messages.Color":
    from foxglove.messages import Color

    red, green, blue = (each / 255 for each in bytes.fromhex(hex_rgb))
    return Color(r=red, g=green, b=blue, a=opacity)


def _pose(pose: Float[np.ndarray, "4 4"]) -> "messages.Pose":
    from foxglove.messages import Pose, Quaternion, Vector3

    return Pose(position=Vector3(**_xyz(pose[:3, 3])), orientation=Quaternion(**_turn(pose)))


def _xyz(values: Float[np.ndarray, "3"]) -> dict[str, float]:
    return dict(zip("xyz", values.tolist(), strict=True))


def _turn(pose: Float[np.ndarray, "4 4"]) -> dict[str, float]:
    return dict(zip("xyzw", Rotation.from_matrix(pose[:3, :3]).as_quat().tolist(), strict=True))
