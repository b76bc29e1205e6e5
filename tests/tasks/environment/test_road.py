from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.layout import Area, Ego, Layout, TrackPoint
from dreamdrive.scene.street.log import Log, LogMap, OfLog, Polygon
from dreamdrive.tasks.environment.road import DrivableArea, road_of_layout, road_of_log
from tests.tasks.environment.scenes import HEIGHT_M, scene

LOG_FROM_WORLD = np.array(
    # Ahead is y of the log, right is x; the camera is at (100, 50), 1.5 m over a ground at 7 m.
    [[1.0, 0, 0, 100.0], [0, 0, 1, 50.0], [0, -1, 0, 7.0 + HEIGHT_M], [0, 0, 0, 1]]
)


def of_log(made: Scene, name: str = "scene-1") -> Scene:
    link = OfLog(name, tuple(map(tuple, LOG_FROM_WORLD.tolist())), 0.0)
    return replace(made, provenance=replace(made.provenance, log=link))


def log(areas: dict[str, tuple[Polygon, ...]]) -> Log:
    return Log("scene-1", "", "here", Path(), (), np.zeros(1), 0, np.eye(4)[None], map=LogMap(areas))


def test_how_far_a_car_sticks_out() -> None:
    road = DrivableArea(shapely.box(-100, -3, 100, 3))
    assert road.sticks_out_m(np.array([0, 0, 4, 2, 0.0])) == 0.0
    assert road.sticks_out_m(np.array([0, 2.5, 4, 2, 0.0])) == pytest.approx(0.5)
    assert road.sticks_out_m(np.array([0, 0, 8, 2, np.pi / 2])) == pytest.approx(1.0)


def test_a_layout_is_seen_from_its_car() -> None:
    road = Area("road", [(10.0, 0.0), (14.0, 0.0), (14.0, 80.0), (10.0, 80.0)])
    kerb = Area("sidewalk", [(13.0, 0.0), (14.0, 0.0), (14.0, 80.0), (13.0, 80.0)])
    crossing = Area("crossing", [(13.0, 40.0), (14.0, 40.0), (14.0, 44.0), (13.0, 44.0)])
    track = [TrackPoint(0, 11, 5, np.pi / 2), TrackPoint(4, 11, 45, np.pi / 2)]
    layout = Layout(Ego(track), areas=[road, kerb, crossing])
    found = road_of_layout(layout).area
    # Ahead is y of the map, left is -x.
    np.testing.assert_allclose(found.bounds, [-5, -3, 75, 1], atol=1e-9)
    assert found.area == pytest.approx(3 * 80 + 4)
    assert not found.contains(shapely.Point(10.0, -2.5))
    assert found.contains(shapely.Point(37.0, -2.5))
    np.testing.assert_allclose(road_of_layout(layout, 2.0).area.bounds, [-25, -3, 55, 1], atol=1e-9)


def test_a_map_of_a_log_lies_where_the_scene_does() -> None:
    box = Polygon(np.array([[97.0, 40.0], [102.0, 40.0], [102.0, 90.0], [97.0, 90.0]]))
    found = road_of_log(log({"drivable_area": (box,), "lane": ()}), of_log(scene()))
    np.testing.assert_allclose(found.area.bounds, [-10, -2, 40, 3], atol=1e-9)


def test_lanes_stand_for_a_road_that_is_not_there() -> None:
    lanes = tuple(
        Polygon(np.array([[x, 40.0], [x + 3, 40.0], [x + 3, 90.0], [x, 90.0]])) for x in (97.0, 99.0)
    )
    found = road_of_log(log({"lane": lanes}), of_log(scene()))
    np.testing.assert_allclose(found.area.bounds, [-10, -2, 40, 3], atol=1e-9)


def test_another_drive_or_an_empty_map_is_refused() -> None:
    with pytest.raises(InputError, match="no drive of a data set"):
        road_of_log(log({}), scene())
    with pytest.raises(InputError, match="made of scene-2"):
        road_of_log(log({}), of_log(scene(), "scene-2"))
    with pytest.raises(InputError, match="no road on its map"):
        road_of_log(log({}), of_log(scene()))
    with pytest.raises(InputError, match="no road on its map"):
        road_of_layout(Layout(Ego([TrackPoint(0, 0, 0, 0)])))
