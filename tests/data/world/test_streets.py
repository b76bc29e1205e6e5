"""Drawn streets: varied, busy, free of collisions, and hard where they are meant to be."""

import cv2
import numpy as np
import pytest
import shapely

from dreamdrive.data.world import StreetOptions, draw_street, drive
from dreamdrive.scene.layout import Layout, is_moving, track_function

SEEDS = range(8)


@pytest.fixture(scope="module")
def layouts() -> list[Layout]:
    return [draw_street(seed) for seed in SEEDS]


def outline(layout: Layout, index: int, t_s: float) -> shapely.Polygon:
    box = layout.boxes[index]
    x, y, yaw = track_function(box.track)(np.array([t_s]))[0]
    length, width, _ = box.size_m
    corners = 0.5 * np.array([[length, width], [-length, width], [-length, -width], [length, -width]])
    turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    return shapely.Polygon(corners @ turn + [x, y])


def test_no_two_boxes_ever_meet_and_none_meets_the_camera(layouts: list[Layout]) -> None:
    for layout in layouts:
        for t_s in np.arange(0, 2.4, 0.3):
            eye = shapely.Point(track_function(layout.ego.track)(np.array([t_s]))[0, :2])
            outlines = [outline(layout, index, float(t_s)) for index in range(len(layout.boxes))]
            tree = shapely.STRtree(outlines)
            first, second = tree.query(outlines, predicate="intersects")
            assert (first == second).all()
            assert not len(tree.query(eye, predicate="intersects"))


def test_traffic_is_near_in_every_street_and_of_every_kind_in_some(layouts: list[Layout]) -> None:
    oncoming = crossing = overtaking = 0
    kinds: set[str] = set()
    for layout in layouts:
        ego = track_function(layout.ego.track)(np.array([0.0, 1.0]))
        ahead = (ego[1] - ego[0])[:2]
        near = 0
        for box in layout.boxes:
            kinds.add(box.kind)
            if not is_moving(box.track):
                continue
            way = track_function(box.track)(np.array([0.0, 1.0]))
            near += np.linalg.norm(way[0, :2] - ego[0, :2]) < 25
            along = (way[1] - way[0])[:2] @ ahead / np.linalg.norm(ahead)
            step = way[1] - way[0]
            across = abs(float(ahead[0] * step[1] - ahead[1] * step[0])) / np.linalg.norm(ahead)
            oncoming += along < -3
            crossing += across > 3 * abs(along)
            overtaking += along > np.linalg.norm(ahead) + 1.5
        assert near >= 1
    assert min(oncoming, crossing, overtaking) >= 1
    assert kinds == {"car", "van", "truck", "bicycle", "pedestrian"}


def test_in_every_second_street_parked_vehicles_look_like_moving_ones(layouts: list[Layout]) -> None:
    alike = []
    for layout in layouts:
        moving, parked = ([b for b in layout.boxes if is_moving(b.track) == yes] for yes in (True, False))
        looks = {(box.kind, box.size_m, box.look) for box in moving}
        alike.append(any((box.kind, box.size_m, box.look) in looks for box in parked))
    assert alike == [seed % 2 == 0 for seed in SEEDS]


def test_streets_differ_in_shape_and_light(layouts: list[Layout]) -> None:
    assert len({len(layout.buildings) for layout in layouts}) > 4
    assert np.ptp([layout.light.sun for layout in layouts]) > 0.3
    assert np.ptp([layout.light.sun_azimuth_rad for layout in layouts]) > 3
    turns = [np.ptp([p.yaw_rad for p in layout.ego.track]) for layout in layouts]
    assert max(turns) > 0.1


def test_actors_are_partly_textured_and_partly_plain_and_dark() -> None:
    """Shares of the pixels of all boxes: local contrast above 4 grey levels; below it and darker than 70."""
    textured = dark = count = 0
    for seed in SEEDS:
        frames = drive(draw_street(seed, StreetOptions(seconds=2.4)), 2, 0.5, antialiased=False)
        for frame, instance in zip(frames.frames, frames.instance, strict=True):
            grey = cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY).astype(np.float32)
            mean = cv2.blur(grey, (5, 5))
            contrast = np.sqrt(np.maximum(cv2.blur(grey * grey, (5, 5)) - mean * mean, 0))
            inside = cv2.erode((instance > 0).astype(np.uint8), np.ones((5, 5))) > 0
            textured += (inside & (contrast > 4)).sum()
            dark += (inside & (contrast <= 4) & (grey < 70)).sum()
            count += inside.sum()
    assert textured / count >= 0.3
    assert dark / count >= 0.1
