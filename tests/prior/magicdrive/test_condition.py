"""What the networks are told of a layout."""

import itertools
from typing import get_args

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.prior.magicdrive.cameras import (
    NUSCENES,
    car_from_camera,
    car_from_lidar,
    crop,
    map_from_car,
    typical_ring,
)
from dreamdrive.prior.magicdrive.condition import (
    AREAS,
    CHANNELS,
    CLASSES,
    KINDS,
    LINES,
    OfLayout,
    as_published,
    box_corners,
    draw_map,
    layout_boxes,
    prompt_of,
    see,
)
from dreamdrive.scene.level import upright
from dreamdrive.scene.street.layout import (
    Area,
    AreaKind,
    Box,
    BoxKind,
    Ego,
    Layout,
    Line,
    LineKind,
    TrackPoint,
    track_function,
)
from streetworld import draw_street
from streetworld.drive import ego_poses
from tests.golden.reading import arrays, close

EAST = Ego([TrackPoint(0.0, 0.0, 0.0, 0.0), TrackPoint(1.0, 10.0, 0.0, 0.0)])
NOW = np.zeros(1)
WORDS = torch.zeros(1, 1, 1)


def rectangle(x0: float, x1: float, y0: float, y1: float) -> list[tuple[float, float]]:
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def lidar_from_map() -> np.ndarray:
    return np.linalg.inv(map_from_car(EAST, NOW)[0] @ car_from_lidar())


def channels(layout: Layout, cells: int = 200) -> dict[str, np.ndarray]:
    return dict(zip(CHANNELS, draw_map(layout, lidar_from_map(), cells), strict=True))


@pytest.mark.parametrize("cells", [200, 400])
def test_rows_run_to_the_right_and_columns_ahead(cells: int) -> None:
    """The LiDAR is 0.76 m behind the front camera, which is at the map's origin."""
    layout = Layout(EAST, [Area("road", rectangle(10, 20, -8, -4))])
    rows, columns = np.nonzero(channels(layout, cells)["drivable_area"])
    per_m = cells / 100
    assert abs(rows.min() - 54 * per_m) <= 1
    assert abs(rows.max() - 58 * per_m) <= 1
    assert abs(columns.min() - 60.76 * per_m) <= 1
    assert abs(columns.max() - 70.76 * per_m) <= 1


def test_each_kind_fills_its_channels_and_covers_earlier_ones() -> None:
    road, island = rectangle(-40, 40, -5, 5), rectangle(0, 10, -1, 1)
    crossing, sidewalk = rectangle(20, 24, -5, 5), rectangle(-40, 40, 5, 8)
    layout = Layout(
        EAST,
        [
            Area("sidewalk", sidewalk),
            Area("road", road, [rectangle(-30, -20, -2, 2)]),
            Area("grass", island),
            Area("crossing", crossing),
            Area("parking", rectangle(-40, 0, -8, -5)),
        ],
        [
            Line("lane_divider", [(-40, 0), (-5, 0)]),
            Line("road_divider", [(12, 3), (18, 3)]),
            Line("stop_line", [(19, -5), (19, 0)]),
            Line("road_edge", [(-40, 5), (40, 5)]),
        ],
    )
    drawn = channels(layout)

    def at(x: float, y: float) -> set[str]:
        place = lidar_from_map() @ [x, y, 0, 1]
        row, column = (int((value + 50) * 2) for value in place[:2])
        return {name for name, cells in drawn.items() if cells[row, column]}

    assert at(-10, 3) == {"drivable_area"}
    assert at(5, 0) == set()
    assert at(-25, 0.9) == set()  # the hole
    assert at(22, 0) == {"drivable_area", "ped_crossing"}
    assert at(-10, 7) == {"walkway"}
    assert at(-20, -7) == {"drivable_area", "carpark_area"}
    assert at(-10, 0) == {"drivable_area", "lane_divider"}
    assert at(15, 3) == {"drivable_area", "road_divider"}
    assert at(19, -3) == {"drivable_area", "stop_line"}
    assert at(-10, 5.3) == {"walkway"}
    assert drawn["road_block"].sum() == 0


def test_every_kind_of_a_layout_has_its_place() -> None:
    assert set(AREAS) == set(get_args(AreaKind))
    assert set(LINES) == set(get_args(LineKind))
    assert set(KINDS) == set(get_args(BoxKind))
    assert set(KINDS.values()) < set(CLASSES)


def test_golden_corners() -> None:
    """Upstream's boxes stand on z and turn clockwise from the left."""
    stored = arrays("magicdrive/forward.safetensors")
    given = stored["in.boxes_xyzwlhyaw"].astype(np.float64).reshape(-1, 7)
    poses = np.stack([upright(np.array([x, y, -yaw - np.pi / 2])) for x, y, *_, yaw in given])
    poses[:, 2, 3] = given[:, 2]
    corners = box_corners(poses, given[:, [4, 3, 5]])
    close(corners, stored["in.boxes_corners_all"].reshape(-1, 8, 3), 1e-6)


def test_the_front_camera_sees_boxes_where_that_of_the_street_world_does() -> None:
    layout = draw_street(4)
    front = np.linalg.inv(
        ego_poses(Layout(Ego(layout.ego.track, NUSCENES[0].place_m[2])), np.array([0.7]))[0]
    )
    lidar_from_map = np.linalg.inv(map_from_car(layout.ego, np.array([0.7]))[0] @ car_from_lidar())
    camera_from_lidar = np.linalg.inv(car_from_camera(NUSCENES[0])) @ car_from_lidar()
    corners, _ = layout_boxes(layout, lidar_from_map, 0.7)
    assert len(corners) == len(layout.boxes) > 3
    for box, seen in zip(layout.boxes, corners, strict=True):
        pose = front @ upright(track_function(box.track)(np.array([0.7]))[0])
        length, width, height = box.size_m
        ends = itertools.product((-length / 2, length / 2), (-width / 2, width / 2), (0, height))
        wanted = np.array([pose @ [*end, 1] for end in ends])[:, :3]
        got = seen @ camera_from_lidar[:3, :3].T + camera_from_lidar[:3, 3]
        apart = np.linalg.norm(got[:, None] - wanted, axis=-1)
        assert max(apart.min(axis=0).max(), apart.min(axis=1).max()) < 1e-9


def test_boxes_are_told_half_their_height_too_high() -> None:
    pose = np.eye(4)
    pose[:3, 3] = 3.0, 10.0, -1.84
    told = as_published(box_corners(pose[None], np.array([[4.0, 2.0, 1.6]])))[0]
    assert told[:, 2].min() == pytest.approx(-1.84 + 0.8)  # the centre
    assert told[:, 2].max() == pytest.approx(-1.84 + 0.8 + 1.6)
    np.testing.assert_allclose(told[:, :2].mean(axis=0), [3.0, 10.0])


def standing(kind: str, x: float, y: float) -> Box:
    return Box(f"{kind} {x} {y}", kind, (4.0, 2.0, 1.5), [TrackPoint(0.0, x, y, 0.0)])  # pyright: ignore


def listed_by(box: Box) -> set[str]:
    present = see(OfLayout(Layout(EAST, boxes=[box])), NOW, 20, WORDS).present[0].any(axis=-1)
    return {camera.name for camera, there in zip(NUSCENES, present, strict=True) if there}


def test_a_camera_lists_the_boxes_before_it() -> None:
    assert listed_by(standing("car", 30, 0)) == {"CAM_FRONT", "CAM_FRONT_LEFT", "CAM_FRONT_RIGHT"}
    assert listed_by(standing("car", -30, 0)) == {"CAM_BACK", "CAM_BACK_LEFT", "CAM_BACK_RIGHT"}
    assert {"CAM_FRONT_RIGHT", "CAM_BACK_RIGHT"} <= listed_by(standing("car", 0, -30))


def test_lists_are_filled_up_to_the_longest() -> None:
    boxes = [standing("van", 30, 0), standing("pedestrian", 25, 3), standing("truck", -30, 0)]
    seen = see(OfLayout(Layout(EAST, boxes=boxes)), np.array([0.0, 1.0]), 20, WORDS)
    assert seen.present.shape == (2, 6, 2)
    assert seen.present[0].sum(axis=-1).tolist() == [2, 2, 1, 1, 1, 2]
    assert [CLASSES[kind] for kind in seen.classes[0, 0]] == ["car", "pedestrian"]
    assert CLASSES[seen.classes[0, 3, 0]] == "truck"
    assert (seen.corners_m[~seen.present] == 0).all()
    # Half a metre a sample: 10 m driven, so the van is 10 m nearer.
    moved = seen.corners_m[0, 0, 0] - seen.corners_m[1, 0, 0]
    np.testing.assert_allclose(moved, np.tile([0.0, 10.0, 0.0], (8, 1)), atol=0.05)
    assert see(OfLayout(Layout(EAST)), NOW, 20, WORDS).present.shape == (1, 6, 0)


def test_cameras_are_told_for_the_full_picture_in_half_precision() -> None:
    cameras = see(OfLayout(Layout(EAST)), NOW, 20, WORDS).cameras[0]
    np.testing.assert_array_equal(cameras[0, :, :3], [[1266, 0, 816], [0, 1266, 491], [0, 0, 1]])
    np.testing.assert_allclose(
        cameras[0, :, 3:], [[1, 0, 0, 0], [0, 0, 1, 0.76], [0, -1, 0, -0.33]], atol=1e-3
    )
    np.testing.assert_array_equal(cameras, cameras.half())


@pytest.mark.parametrize(
    ("size", "focal", "centre"),
    [
        ((400, 224), 316.5, (204.0, 121.75)),
        ((800, 424), 633.0, (408.0, 219.5)),
        ((736, 272), 633.0, (376.0, 67.5)),
    ],
)
def test_intrinsics_of_the_published_sizes(
    size: tuple[int, int], focal: float, centre: tuple[float, float]
) -> None:
    front = typical_ring().rig(size)[0]
    assert (front.fx_px, front.fy_px) == (focal, focal)
    assert (front.cx_px, front.cy_px) == pytest.approx(centre)
    assert (front.width_px, front.height_px) == size


def test_a_picture_taller_than_the_full_one_is_refused() -> None:
    with pytest.raises(InputError, match="taller than 9/16"):
        crop((400, 240))


def test_the_rig_is_a_ring_to_the_right_from_the_front() -> None:
    cameras = typical_ring().rig((400, 224))
    assert (cameras[0].world_from_camera == np.eye(4)).all()
    ahead = np.stack([camera.world_from_camera[:3, 2] for camera in cameras])
    turns = np.rad2deg(np.unwrap(np.arctan2(ahead[:, 0], ahead[:, 2])))
    assert (np.diff(turns) > 50).all()
    assert turns[-1] < 360
    assert [camera.name for camera in NUSCENES][:2] == ["CAM_FRONT", "CAM_FRONT_RIGHT"]
    up = np.stack([camera.world_from_camera[:3, 1] for camera in cameras])
    np.testing.assert_allclose(up, np.tile([0.0, 1.0, 0.0], (6, 1)), atol=1e-12)


def test_the_front_camera_is_on_the_path() -> None:
    ego = draw_street(4).ego
    times = np.array([0.0, 1.3])
    front = (map_from_car(ego, times) @ car_from_camera(NUSCENES[0]))[:, :3, 3]
    assert front[0, :2] == pytest.approx([ego.track[0].x_m, ego.track[0].y_m])
    np.testing.assert_allclose(front[:, 2], 1.51)


def test_words_go_into_the_sentence_of_the_training() -> None:
    assert prompt_of("Rain, night.") == "A driving scene image at boston-seaport. Rain, night."
    assert prompt_of(None).endswith("sunny.")
