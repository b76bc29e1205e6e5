"""Streets of the second edition: of all kinds, free of collisions, and of looks that training never sees."""

from collections import Counter
from typing import get_args

import msgspec
import numpy as np
import pytest
import shapely
from msgspec.structs import replace

from dreamdrive.data.layout_file import read_layout, write_layout
from dreamdrive.errors import InputError
from dreamdrive.scene.street.layout import Box, Layout, is_moving, track_function
from streetworld import StreetKind, StreetOptions, draw_street, drive

KINDS = get_args(StreetKind)
TRAINING = 1_000_000


def street(seed: int, kind: StreetKind | None = None, seconds: float = 2.4) -> Layout:
    return draw_street(seed, StreetOptions(seconds, edition=2, kind=kind))


def outlines(box: Box, times_s: np.ndarray) -> np.ndarray:
    """A polygon at each time."""
    x, y, yaw = track_function(box.track)(times_s).T
    length, width, _ = box.size_m
    corners = 0.5 * np.array([[length, width], [-length, width], [-length, -width], [length, -width]])
    turn = np.stack([np.cos(yaw), np.sin(yaw), -np.sin(yaw), np.cos(yaw)], axis=-1).reshape(-1, 2, 2)
    return shapely.polygons(corners @ turn + np.stack([x, y], axis=-1)[:, None])


def looks(layout: Layout) -> list[int]:
    things = [*layout.boxes, *layout.buildings, *layout.props, *layout.barriers]
    return [thing.look for thing in things] + [layout.lens.bonnet or 0] * (layout.lens.bonnet is not None)


def test_equal_seeds_give_equal_streets_and_others_differ() -> None:
    first, again, other = (msgspec.json.encode(street(seed)) for seed in (TRAINING, TRAINING, TRAINING + 1))
    assert first == again != other


@pytest.mark.parametrize("kind", KINDS)
def test_no_two_boxes_ever_meet_and_none_meets_the_recording_car(kind: StreetKind) -> None:
    for seed in range(TRAINING, TRAINING + 3):
        layout, times_s = street(seed, kind), np.arange(0, 2.4, 0.3)
        own = track_function(layout.ego.track)(times_s)
        others = np.stack([outlines(box, times_s) for box in layout.boxes], axis=1)
        for (x, y, yaw), there in zip(own, others, strict=True):
            car = shapely.LineString([(x, y), (x - 2.5 * np.cos(yaw), y - 2.5 * np.sin(yaw))]).buffer(0.6)
            tree = shapely.STRtree(there)
            one, two = tree.query(there, predicate="intersects")
            assert (one == two).all()
            assert not len(tree.query(car, predicate="intersects"))


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_stands_on_the_road_or_in_a_house(kind: StreetKind) -> None:
    layout = street(TRAINING + 7, kind)
    houses = shapely.union_all([shapely.Polygon(house.polygon).buffer(-0.1) for house in layout.buildings])
    way = shapely.LineString([(p.x_m, p.y_m) for p in layout.ego.track]).buffer(0.9)
    for prop in layout.props:
        point = shapely.Point(prop.at_m)
        assert not houses.intersects(point)
        assert prop.kind == "cone" or not way.intersects(point)
    for barrier in layout.barriers:
        line = shapely.LineString(barrier.points)
        assert not way.intersects(line)
        assert not houses.intersects(line)
    assert not houses.intersects(way)


@pytest.mark.parametrize("kind", KINDS)
def test_areas_are_polygons_that_a_layout_file_takes(kind: StreetKind, tmp_path) -> None:
    layout = street(TRAINING + 11, kind)
    assert all(shapely.Polygon(area.polygon, area.holes).is_valid for area in layout.areas)
    write_layout(layout, tmp_path / "street.json")
    assert read_layout(tmp_path / "street.json") == layout


@pytest.mark.slow
def test_streets_are_of_many_kinds() -> None:
    layouts = [street(seed) for seed in range(TRAINING + 10, TRAINING + 34)]
    kinds = Counter(box.kind for layout in layouts for box in layout.boxes)
    assert set(kinds) == {"car", "van", "truck", "bus", "motorcycle", "bicycle", "pedestrian"}
    props = Counter(prop.kind for layout in layouts for prop in layout.props)
    assert len(props) == 8
    assert {barrier.kind for layout in layouts for barrier in layout.barriers} == {
        "fence",
        "hedge",
        "wall",
        "rail",
    }
    counts = np.array([len(layout.boxes) for layout in layouts])
    assert counts.min() < 12
    assert counts.max() > 80
    level = np.mean([layout.relief.height_m == 0 for layout in layouts])
    assert 0.3 < level < 0.7
    lights = [layout.light for layout in layouts]
    assert all(
        any(getattr(light, name) > 0 for light in lights) for name in ("night", "rain", "snow", "glare")
    )
    assert sum(max(light.night, light.rain, light.snow) == 0 for light in lights) > 12
    # Where traffic keeps to the left, the recording car is left of the middle of the road.
    assert any(layout.ego.track[0].y_m > 1 for layout in layouts)


def test_looks_of_test_streets_are_those_that_training_never_shows() -> None:
    for seed in (3, 1000, 1015):
        assert {look % 5 for look in looks(street(seed))} == {4}
    seen = {look % 5 for seed in range(TRAINING, TRAINING + 10) for look in looks(street(seed))}
    assert seen == {0, 1, 2, 3}


def test_as_many_boxes_as_asked_for() -> None:
    layout = draw_street(TRAINING, StreetOptions(1.0, movers=3, parked=2, edition=2, kind="town"))
    assert [is_moving(box.track) for box in layout.boxes] == [True] * 3 + [False] * 2
    empty = draw_street(TRAINING, StreetOptions(1.0, movers=0, parked=0, speed_m_s=0.0, edition=2))
    assert empty.boxes == []
    assert not is_moving(empty.ego.track)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1002, 1003])
def test_a_queue_fills_most_of_the_picture_and_moves(seed: int) -> None:
    layout = draw_street(seed, StreetOptions(1.2, edition=2, traffic="queue"))
    start = layout.ego.track[0]
    yaws = [box.track[0].yaw_rad - start.yaw_rad for box in layout.boxes if is_moving(box.track)]
    assert min(np.cos(yaws)) < -0.9  # some come towards the camera
    # What is far away is behind the others, and takes its time to be made.
    near = [b for b in layout.boxes if np.hypot(b.track[0].x_m - start.x_m, b.track[0].y_m - start.y_m) < 25]
    seen = drive(replace(layout, boxes=near), 2, fps=1.25, size=(96, 56), antialiased=False)
    assert 0.6 < seen.moving.mean() < 0.9
    assert 3 <= seen.trajectory.length_m / 0.8 <= 6


@pytest.mark.slow
def test_a_minute_can_be_drawn() -> None:
    layout = street(TRAINING + 2, "city", seconds=60.0)
    assert len(layout.boxes) <= 255
    assert is_moving(layout.ego.track)


def test_the_first_edition_has_neither_kinds_nor_queues() -> None:
    with pytest.raises(InputError, match="edition 1 has neither kinds of streets nor queues"):
        draw_street(0, StreetOptions(kind="city"))
    with pytest.raises(InputError, match="edition 1 has neither kinds of streets nor queues"):
        draw_street(0, StreetOptions(traffic="queue"))
