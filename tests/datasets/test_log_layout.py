"""The layout of a drive."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.datasets.log_layout import clipped, kind_of, layout_of_log
from dreamdrive.scene.street.layout import track_function
from tests.logs import ego, log


@pytest.fixture
def drive(tmp_path):
    return log(tmp_path / "made")


def test_the_layout_lies_where_the_drive_does(drive):
    layout = layout_of_log(drive)
    assert [box.kind for box in layout.boxes] == ["car", "truck"]
    assert [len(box.track) for box in layout.boxes] == [3, 1]
    path = track_function(layout.ego.track)(np.array([0.0, 1.0]))
    origin = ego(0.0)[:2, 3]
    for t, (x, y, yaw) in zip((0.0, 1.0), path, strict=True):
        pose = ego(t) @ drive.cameras[0].ego_from_camera
        np.testing.assert_allclose((x, y), pose[:2, 3] - origin, atol=1e-6)
        assert yaw == pytest.approx(0.2 + 0.05 * t)
    assert layout.ego.camera_height_m == pytest.approx(1.4)
    assert layout.boxes[0].size_m == (4.5, 1.9, 1.6)
    assert layout.boxes[0].track[0].x_m == pytest.approx(15.0)


def test_the_map_keeps_its_layers(drive):
    layout = layout_of_log(drive)
    assert [area.kind for area in layout.areas] == ["sidewalk", "road"]
    assert len(layout.areas[1].holes) == 1
    assert [line.kind for line in layout.lines] == ["lane_divider"]
    assert min(x for x, _ in layout.areas[1].polygon) == pytest.approx(-50.0)


def test_the_map_ends_beside_the_drive(drive):
    far = replace(
        drive, world_from_ego=drive.world_from_ego + np.array([[[0, 0, 0, 1000.0]] + [[0] * 4] * 3])
    )
    assert layout_of_log(far).areas == []


def test_the_lens_is_that_of_the_first_camera(drive):
    lens = layout_of_log(drive).lens
    assert lens.hfov_rad == pytest.approx(2 * np.arctan(32 / 50))
    assert lens.pitch_rad == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("category", "kind"),
    [
        ("vehicle.car", "car"),
        ("vehicle.bus.bendy", "bus"),
        ("vehicle.emergency.ambulance", "van"),
        ("human.pedestrian.construction_worker", "pedestrian"),
        ("movable_object.barrier", None),
        ("vehicle.carriage", None),
    ],
)
def test_kinds(category, kind):
    assert kind_of(category) == kind


@given(st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=3, max_size=8))
def test_what_is_clipped_lies_inside(points):
    within = np.array([[-3.0, -2.0], [4.0, 5.0]])
    left = clipped(np.array(points), within)
    if len(left):
        assert (left >= within[0] - 1e-9).all()
        assert (left <= within[1] + 1e-9).all()


def test_a_square_is_clipped_to_a_rectangle():
    square = np.array([[-10.0, -10], [10, -10], [10, 10], [-10, 10]])
    left = clipped(square, np.array([[-1.0, -2], [3, 4]]))
    assert {(float(x), float(y)) for x, y in left} == {(-1, -2), (3, -2), (3, 4), (-1, 4)}
