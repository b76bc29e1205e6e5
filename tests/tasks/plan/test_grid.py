"""Cells and metres, and what is drawn, against UniAD's and ST-P3's programs."""

import json

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.scene.street.log import box_corners
from dreamdrive.tasks.perception import flat_pose
from dreamdrive.tasks.plan import GRID, Occupancy, PlanningGrid, corners
from tests.golden.reading import FOLDER, arrays

UNIAD, STP3, SCENES = "eval/bev_raster_uniad.npz", "eval/bev_raster_stp3.npz", "eval/bev_raster_cvt.json"
grids = st.builds(PlanningGrid, st.integers(1, 150).map(lambda half: 2 * half), st.floats(0.1, 2))


@given(grids, st.integers(0, 299), st.integers(0, 299))
def test_cells_come_back(grid: PlanningGrid, row: int, column: int) -> None:
    cell = np.array([[row % grid.cells, column % grid.cells]])
    assert grid.cells_at(grid.centres_m(cell)).tolist() == cell.tolist()
    assert np.abs(grid.centres_m(cell)).max() < grid.half_m
    assert grid.holds(cell).all()


@given(grids, st.floats(-1, 1), st.floats(-1, 1))
def test_a_point_is_within_half_a_cell_of_the_centre_of_its_cell(
    grid: PlanningGrid, x: float, y: float
) -> None:
    point = np.array([x, y]) * grid.half_m
    apart = grid.centres_m(grid.cells_at(point)) - point
    assert np.abs(apart).max() <= grid.cell_m / 2 + 1e-9


def test_rows_are_ahead_and_columns_to_the_right() -> None:
    cell = GRID.cells_at(np.array([10.1, 20.1]))
    assert cell.tolist() == [140, 120]
    assert GRID.centres_m(cell).tolist() == [10.25, 20.25]
    outside = np.array([[0.0, 50.1], [-50.1, 0.0]])
    assert not GRID.holds(GRID.cells_at(outside)).any()


@pytest.mark.parametrize("wrong", [{"cells": 3}, {"cells": 0}, {"cell_m": 0.0}])
def test_a_grid_without_cells_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match="an even number of cells"):
        PlanningGrid(**wrong)  # pyright: ignore[reportArgumentType]


def test_golden_boxes_of_uniad() -> None:
    wanted = arrays(UNIAD)
    polygons = wanted["corners"].astype(np.float64)
    np.testing.assert_array_equal(GRID.vertices(polygons), wanted["vertices"])
    np.testing.assert_array_equal(GRID.draw(polygons), wanted["union"])
    every = np.unpackbits(wanted["each"], axis=-1).reshape(-1, GRID.cells, GRID.cells)
    for polygon, cells in zip(polygons, every, strict=True):
        np.testing.assert_array_equal(GRID.draw(polygon[None]), cells)


def test_golden_corners_of_uniad() -> None:
    wanted = arrays(UNIAD)
    boxes = np.column_stack([wanted["centre"], wanted["length_width"], wanted["yaw"]]).astype(np.float64)
    ours, theirs = corners(boxes), wanted["corners"]
    # The order differs; each corner of ours is one of theirs.
    apart = np.linalg.norm(ours[:, :, None] - theirs[:, None], axis=-1)
    assert apart.min(axis=2).max() < 1e-4
    assert apart.min(axis=1).max() < 1e-4


@pytest.mark.parametrize(("name", "begins"), [("vehicle", "vehicle"), ("pedestrian", "human")])
def test_golden_boxes_of_stp3(name: str, begins: str) -> None:
    """Bottoms of boxes in the level frame of the car: rows are x ahead, columns are y left."""
    wanted = arrays(STP3)[name]
    for scene, cells in zip(json.loads((FOLDER / SCENES).read_text()), wanted, strict=True):
        car = flat_pose(pose(scene["rotation"], scene["translation"]))
        polygons = [
            (box_corners(pose(each["rotation"], each["translation"]), np.array(each["size"])[[1, 0, 2]])[4:])
            for each in scene["annotations"]
            if each["category_name"].startswith(begins) and each["visibility_token"] != "1"
        ]
        in_car = (np.reshape(polygons, (-1, 4, 3)) - car[:3, 3]) @ car[:3, :3]
        np.testing.assert_array_equal(GRID.draw(in_car[..., 1::-1]), cells)


def pose(rotation: list[float], translation: list[float]) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3] = Rotation.from_quat(np.roll(rotation, -1)).as_matrix()
    made[:3, 3] = translation
    return made


def test_what_is_drawn_covers_the_lines_of_the_grid_in_it() -> None:
    cells = GRID.draw(np.array([[[2.0, 3.0], [4.0, 3.0], [4.0, 7.0], [2.0, 7.0]]]))
    rows, columns = np.nonzero(cells)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (106, 114, 104, 108)
    assert cells.sum() == 9 * 5


def test_nothing_drawn_is_nothing() -> None:
    assert not GRID.draw(np.zeros((0, 4, 2))).any()


@given(st.integers(1, 5), st.lists(st.floats(0, 9), min_size=1, max_size=4))
def test_points_are_centres_of_cells_at_the_time(frames: int, times: list[float]) -> None:
    taken = np.zeros((frames, 200, 200), bool)
    for frame in range(frames):
        taken[frame, 100 + frame, 90:92] = True
    found = Occupancy(taken).points_at(np.array(times))
    for time, points in zip(times, found, strict=True):
        frame = min(round(time / 0.5), frames - 1)
        assert points.tolist() == [[-4.75, 0.25 + 0.5 * frame], [-4.25, 0.25 + 0.5 * frame]]


def test_cells_of_another_grid_are_refused() -> None:
    with pytest.raises(ValueError, match="cells of shape"):
        Occupancy(np.zeros((1, 100, 100), bool))


def test_a_box_is_drawn_as_opencv_fills_it() -> None:
    """Each box by itself: where two overlap nothing is left out."""
    boxes = np.array([[0.0, 0, 6, 3, 0.4], [1.0, 1, 6, 3, 1.4]])
    one = np.maximum(*(GRID.draw(corners(box[None])) for box in boxes))
    np.testing.assert_array_equal(GRID.draw(corners(boxes)), one)
    together = np.zeros((200, 200), np.uint8)
    cv2.fillPoly(together, list(GRID.vertices(corners(boxes))), 1)
    assert together.sum() < one.sum()
