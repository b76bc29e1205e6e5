"""Labels in cells against the original's, cell by cell, and against a plain reference."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.scene.street.log import LogMap, Polygon
from dreamdrive.tasks.perception import (
    LAYERS,
    NO_VEHICLE,
    Annotation,
    BevGrid,
    BevLabels,
    bev_labels,
    flat_pose,
)
from tests.golden.reading import FOLDER, arrays, close

NUMBERS, SCENES = "eval/bev_raster_cvt.npz", "eval/bev_raster_cvt.json"
GRID = BevGrid()


def pose(rotation: list[float], translation: list[float]) -> np.ndarray:
    """From a quaternion wxyz and a place."""
    w, x, y, z = np.array(rotation) / np.linalg.norm(rotation)
    made = np.eye(4)
    made[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    made[:3, 3] = translation
    return made


def scenes() -> list[dict]:
    arrays(NUMBERS)  # skips where they are absent
    return json.loads((FOLDER / SCENES).read_text())


def golden_labels(scene: dict, grid: BevGrid = GRID) -> BevLabels:
    annotations = [
        Annotation(
            each["category_name"],
            pose(each["rotation"], each["translation"]),
            np.array(each["size"])[[1, 0, 2]],
            int(each["visibility_token"]),
        )
        for each in scene["annotations"]
    ]
    areas = {
        name: tuple(Polygon(np.array(outline), tuple(map(np.array, holes))) for outline, holes in polygons)
        for name, polygons in scene["polygons"].items()
    }
    lines = {name: tuple(map(np.array, each)) for name, each in scene["lines"].items()}
    world_from_ego = pose(scene["rotation"], scene["translation"])
    return bev_labels(grid, world_from_ego, annotations, LogMap(areas, lines))


def test_golden_cells() -> None:
    wanted = arrays(NUMBERS)
    for index, scene in enumerate(scenes()):
        labels = golden_labels(scene)
        np.testing.assert_array_equal(labels.bits(), wanted["bev"][index])
        np.testing.assert_array_equal(labels.visibility, wanted["visibility"][index])
        for channel in range(8):
            # Direction and size come from a norm, whose last bit is the processor's.
            close(labels.auxiliary[..., channel], wanted["aux"][index, ..., channel], 1e-6, str(channel))


def test_golden_poses() -> None:
    np.testing.assert_array_equal(GRID.pixels_from_ego(), arrays(NUMBERS)["view"])
    for scene in scenes():
        flat = flat_pose(pose(scene["rotation"], scene["translation"]))
        np.testing.assert_allclose(flat, scene["pose"], rtol=0, atol=1e-7)


def test_golden_streets_on_a_coarser_grid_look_alike() -> None:
    for scene in scenes():
        fine = golden_labels(scene)
        coarse = golden_labels(scene, BevGrid(104, 104, 100.0, 100.0))
        assert coarse.layers.shape == (12, 104, 104)
        near = cv2.resize(fine.road(), (104, 104), interpolation=cv2.INTER_NEAREST)
        assert (near != coarse.road()).mean() < 0.04


def box(category: str, x: float, y: float, yaw: float = 0.0, visibility: int = 4) -> Annotation:
    turn = [np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
    return Annotation(category, pose(turn, [x, y, 1.0]), np.array([4.0, 2.0, 1.5]), visibility)


def draw(*annotations: Annotation, grid: BevGrid = GRID) -> BevLabels:
    return bev_labels(grid, np.eye(4), annotations, LogMap())


def test_ahead_is_up_and_left_is_left() -> None:
    rows, columns = np.nonzero(draw(box("vehicle.car", 20.0, 10.0)).vehicle())
    assert (rows.min(), rows.max()) == (56, 64)
    assert (columns.min(), columns.max()) == (78, 82)


def test_centre_offset_and_direction() -> None:
    auxiliary = draw(box("vehicle.car", 20.0, 10.0)).auxiliary
    assert auxiliary[60, 80].tolist() == pytest.approx([255, 1, 0, 0, 0, -1, 4, 2], abs=1e-5)
    assert auxiliary[59, 81].tolist() == pytest.approx([255, np.exp(-2), -1, 1, 0, -1, 4, 2], abs=1e-5)
    assert not auxiliary[0, 0].any()


@pytest.mark.parametrize(
    ("category", "layer"),
    [
        ("vehicle.car", "car"),
        ("vehicle.bus.bendy", "bus"),
        ("vehicle.construction", "construction"),
        ("human.pedestrian.construction_worker", "pedestrian"),
        ("human.pedestrian.adult", "pedestrian"),
        ("vehicle.bicycle", "bicycle"),
        ("static_object.bicycle_rack", None),
        ("vehicle.emergency.police", None),
        ("movable_object.barrier", None),
    ],
)
def test_the_layer_of_a_category(category: str, layer: str | None) -> None:
    labels = draw(box(category, 5.0, 0.0))
    drawn = [LAYERS[index] for index in np.nonzero(labels.layers.any(axis=(1, 2)))[0]]
    assert drawn == ([layer] if layer else [])


def test_an_emergency_vehicle_is_in_the_auxiliary_maps_alone() -> None:
    labels = draw(box("vehicle.emergency.ambulance", 5.0, 0.0, visibility=3))
    assert not labels.vehicle().any()
    assert labels.centre().max() == 1
    assert set(np.unique(labels.visibility)) == {3, NO_VEHICLE}
    walker = draw(box("human.pedestrian.adult", 5.0, 0.0))
    assert not walker.auxiliary.any()
    assert (walker.visibility == NO_VEHICLE).all()


def test_the_last_vehicle_hides_those_before() -> None:
    first, second = box("vehicle.car", 5.0, 0.0, visibility=1), box("vehicle.truck", 5.0, 0.0, visibility=4)
    assert (draw(first, second).visibility == 4).any()
    assert not (draw(first, second).visibility == 1).any()


def test_a_hole_erases_earlier_areas() -> None:
    def square(half: float) -> np.ndarray:
        return np.array([[half, half], [half, -half], [-half, -half], [-half, half]])

    whole, ring = Polygon(square(20.0)), Polygon(square(15.0), (square(5.0),))
    drawn = [
        bev_labels(GRID, np.eye(4), (), LogMap({"lane": each})).road()[100, 100]
        for each in ((whole,), (ring,), (ring, whole), (whole, ring))
    ]
    assert drawn == [1, 0, 1, 0]


def test_dividers_are_lines_and_no_road() -> None:
    line = np.array([[0.0, -10.0], [0.0, 10.0]])
    labels = bev_labels(GRID, np.eye(4), (), LogMap({}, {"lane_divider": (line,), "walkway": (line,)}))
    assert labels.layers[LAYERS.index("lane_divider")].sum() == 41
    assert labels.layers.sum() == 41
    assert not labels.road().any()


def test_a_tilted_car_sees_nearly_the_same_street() -> None:
    """Not quite: the last of three turns is not the direction in which a car with roll and pitch points."""
    level = pose([np.cos(0.3), 0, 0, np.sin(0.3)], [100.0, 50.0, 3.0])
    tilted = level @ pose([np.cos(0.01), np.sin(0.01), 0, 0], [0, 0, 0])
    np.testing.assert_allclose(flat_pose(tilted), flat_pose(level), atol=1e-3)


def test_a_box_that_is_no_pose_is_refused() -> None:
    with pytest.raises(ValueError, match="not a rotation"):
        replace(box("vehicle.car", 0.0, 0.0), world_from_box=np.diag([2.0, 2.0, 2.0, 1.0]))


@given(
    x=st.floats(-45, 45),
    y=st.floats(-45, 45),
    yaw=st.floats(-np.pi, np.pi),
    ego=st.tuples(st.floats(-1000, 1000), st.floats(-1000, 1000), st.floats(-np.pi, np.pi)),
    cells=st.sampled_from([(200, 200), (104, 104), (60, 120)]),
)
def test_cells_are_those_inside_the_box(
    x: float, y: float, yaw: float, ego: tuple[float, float, float], cells: tuple[int, int]
) -> None:
    """Inside by more than a cell is drawn, outside by more than a cell is not."""
    grid = BevGrid(*cells, 100.0, 100.0)
    turn = [np.cos(ego[2] / 2), 0, 0, np.sin(ego[2] / 2)]
    world_from_ego = pose(turn, [*ego[:2], 0.0])
    world_from_box = world_from_ego @ box("vehicle.car", x, y, yaw).world_from_box
    placed = Annotation("vehicle.car", world_from_box, np.array([9.0, 5.0, 2.0]), 4)
    drawn = bev_labels(grid, world_from_ego, (placed,), LogMap()).vehicle()
    rows, columns = np.meshgrid(np.arange(grid.rows), np.arange(grid.columns), indexing="ij")
    ahead, left = 50 - rows * 100 / grid.rows - x, 50 - columns * 100 / grid.columns - y
    along, across = (
        ahead * np.cos(yaw) + left * np.sin(yaw),
        left * np.cos(yaw) - ahead * np.sin(yaw),
    )
    beyond = np.maximum(abs(along) - 4.5, abs(across) - 2.5)
    margin = 1.5 * 100 / min(cells)
    assert drawn[beyond < -margin].all()
    assert not drawn[beyond > margin].any()
