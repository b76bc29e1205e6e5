"""Drawn streets: varied, busy, free of collisions, and hard where they are meant to be."""

import cv2
import numpy as np
import pytest
import shapely

from dreamdrive.errors import InputError
from dreamdrive.scene.street.layout import Layout, is_moving, track_function
from streetworld import StreetOptions, draw_street, drive
from streetworld.engine.road import travelled_m

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


def look_alikes(layout: Layout) -> bool:
    """Whether a parked vehicle looks the same as a moving one."""
    moving, parked = ([b for b in layout.boxes if is_moving(b.track) == yes] for yes in (True, False))
    looks = {(box.kind, box.size_m, box.look) for box in moving}
    return any((box.kind, box.size_m, box.look) in looks for box in parked)


def near_movers(layout: Layout) -> int:
    """Moving boxes within 25 m of the camera at the start."""
    start = track_function(layout.ego.track)(np.zeros(1))[0, :2]
    places = [track_function(b.track)(np.zeros(1))[0, :2] for b in layout.boxes if is_moving(b.track)]
    return sum(bool(np.linalg.norm(place - start) < 25) for place in places)


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
        for box in layout.boxes:
            kinds.add(box.kind)
            if not is_moving(box.track):
                continue
            way = track_function(box.track)(np.array([0.0, 1.0]))
            along = (way[1] - way[0])[:2] @ ahead / np.linalg.norm(ahead)
            step = way[1] - way[0]
            across = abs(float(ahead[0] * step[1] - ahead[1] * step[0])) / np.linalg.norm(ahead)
            oncoming += along < -3
            crossing += across > 3 * abs(along)
            overtaking += along > np.linalg.norm(ahead) + 1.5
        assert near_movers(layout) >= 1
    assert min(oncoming, crossing, overtaking) >= 1
    assert kinds == {"car", "van", "truck", "bicycle", "pedestrian"}


def test_in_every_second_street_parked_vehicles_look_like_moving_ones(layouts: list[Layout]) -> None:
    assert [look_alikes(layout) for layout in layouts] == [seed % 2 == 0 for seed in SEEDS]


def test_streets_differ_in_shape_and_light(layouts: list[Layout]) -> None:
    assert len({len(layout.buildings) for layout in layouts}) > 4
    assert np.ptp([layout.light.sun for layout in layouts]) > 0.3
    assert np.ptp([layout.light.sun_azimuth_rad for layout in layouts]) > 3
    turns = [np.ptp([p.yaw_rad for p in layout.ego.track]) for layout in layouts]
    assert max(turns) > 0.1


@pytest.mark.slow
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


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_long_drive_keeps_going_on_its_road(seed: int) -> None:
    """Straight, bend and crossing: 20 s, in which a constant change of speed would turn cars round."""
    layout = draw_street(seed, StreetOptions(seconds=20.0))
    times_s = np.arange(0, 20.0, 0.1)
    road = shapely.union_all([shapely.Polygon(a.polygon, a.holes) for a in layout.areas if a.kind == "road"])
    tracks = {box.id: track_function(box.track)(times_s) for box in layout.boxes if is_moving(box.track)}
    tracks["ego"] = track_function(layout.ego.track)(times_s)
    for name, way in tracks.items():
        velocity = np.diff(way[:, :2], axis=0) / 0.1
        ahead = np.sum(velocity * np.stack([np.cos(way[:-1, 2]), np.sin(way[:-1, 2])], axis=-1), axis=1)
        assert ahead.min() > -0.05, name
        assert ahead.max() < 16.5, name
        standing = np.abs(ahead) < 0.05
        assert not standing[-50:].all() or not name.startswith(("car", "van", "truck")), name
        kind = name.split("-")[0]
        if kind in ("ego", "car", "van", "truck"):
            assert shapely.contains_xy(road, way[:, 0], way[:, 1]).all(), name
    # The road leads on from where the car ends: a circle around it cuts the road before it and behind it.
    circle = shapely.Point(tracks["ego"][-1, :2]).buffer(60).boundary
    assert len(shapely.get_parts(circle.intersection(road))) >= 2


def test_a_change_of_speed_ends() -> None:
    times_s = np.arange(0, 20, 0.5)
    for speed, change, least, slowest, fastest in (
        (6.0, 0.8, 0.0, 6.0, 9.2),
        (6.0, -0.8, 0.0, 2.8, 6.0),
        (3.1, -0.8, 1.0, 1.0, 3.1),
        (15.0, 0.8, 0.0, 15.0, 16.0),
        (-9.0, 0.0, 0.0, -9.0, -9.0),
    ):
        pace = np.diff(travelled_m(times_s, speed, change, least)) / 0.5
        assert pace.min() >= slowest - 1e-9
        assert pace.max() <= fastest + 1e-9
        assert pace[-1] == pytest.approx(slowest if change < 0 else fastest)


def test_longer_drives_than_a_street_holds_are_refused() -> None:
    with pytest.raises(InputError, match="at most 60 s"):
        draw_street(0, StreetOptions(seconds=61))


UNSEEN = (138, 1001, 1002, 1003, 1004, 1006, 7777, 31415)


def test_streets_of_any_seed_have_near_traffic_and_look_alikes_by_turns() -> None:
    layouts = [draw_street(seed) for seed in UNSEEN]
    assert [look_alikes(layout) for layout in layouts] == [seed % 2 == 0 for seed in UNSEEN]
    assert all(near_movers(layout) >= 1 for layout in layouts)
