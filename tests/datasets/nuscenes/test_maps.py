"""Maps of nuScenes in all their ways."""

import json
import shutil

import cv2
import numpy as np
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays

from dreamdrive.datasets.nuscenes import read_nuscenes
from dreamdrive.datasets.nuscenes.maps import polygons_of

FAR = np.array([[-1e6, -1e6], [1e6, 1e6]])


def test_two_maps_of_one_name_are_named_and_the_rest_works(folder):
    place = folder / "maps/expansion/nowhere-scene-0001.json"
    other = json.loads(place.read_text())
    other["node"][0]["x"] += 1
    (folder / "maps/nowhere-scene-0001.json").write_text(json.dumps(other))
    log = read_nuscenes(folder, "scene-0001")
    assert not log.map
    assert "two maps of the name nowhere-scene-0001" in log.problems[0]
    assert len(log.cameras) == 2
    shutil.copy(place, folder / "maps/nowhere-scene-0001.json")
    (folder / "v1.0-mini/log.json").touch()
    assert read_nuscenes(folder, "scene-0001").map  # the same twice is one


def test_a_damaged_expansion_is_named(folder):
    (folder / "maps/expansion/nowhere-scene-0001.json").write_text("{")
    log = read_nuscenes(folder, "scene-0001")
    assert not log.map
    assert "damaged or no map expansion" in log.problems[0]


def test_polygons_that_point_nowhere_are_left_out(folder):
    place = folder / "maps/expansion/nowhere-scene-0001.json"
    values = json.loads(place.read_text())
    values["walkway"][0]["polygon_token"] = "gone"
    place.write_text(json.dumps(values))
    log = read_nuscenes(folder, "scene-0001")
    assert log.map.areas["walkway"] == ()
    assert len(log.map.areas["drivable_area"]) == 1
    assert "polygons point to nothing and are left out (1, the first: gone)" in log.problems[0]


def test_without_an_expansion_the_picture_is_taken(folder):
    shutil.rmtree(folder / "maps/expansion")
    area = read_nuscenes(folder, "scene-0001").map.areas["drivable_area"]
    assert len(area) == 1
    np.testing.assert_allclose(area[0].outline.min(axis=0), [150, 295], atol=0.11)
    np.testing.assert_allclose(area[0].outline.max(axis=0), [280, 315], atol=0.11)
    assert len(area[0].holes) == 1
    np.testing.assert_allclose(area[0].holes[0].mean(axis=0), [232.5, 302.5], atol=0.3)


def test_two_pictures_of_one_drive_are_named(folder, change):
    shutil.rmtree(folder / "maps/expansion")
    change("map", lambda rows: rows.append(rows[0] | {"token": "other", "filename": "maps/other.png"}))
    log = read_nuscenes(folder, "scene-0001")
    assert not log.map
    assert "map.json names two maps of one drive" in log.problems[0]


def test_layers_of_pictures_are_read(data_dir):
    areas = read_nuscenes(data_dir / "nuscenes_format/pandaset_002", "scene-0002").map.areas
    assert len(areas["drivable_area"]) == 9
    assert len(areas["walkway"]) == 12


@given(arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12))))
def test_outlines_hold_what_is_covered(mask):
    mask = np.kron(mask, np.ones((4, 4), bool))
    found = polygons_of(mask, np.zeros(2), 1.0, FAR)
    rings = [ring for polygon in found for ring in (polygon.outline, *polygon.holes)]
    drawn = np.zeros(mask.shape, np.uint8)
    cv2.fillPoly(drawn, [np.rint(ring).astype(np.int32) for ring in rings], 1)  # even and odd
    assert (drawn.astype(bool) == mask).mean() > 0.95


def test_outlines_lie_where_the_pixels_do():
    mask = np.zeros((30, 40), bool)
    mask[5:11, 7:27] = True
    (polygon,) = polygons_of(mask, np.array([100.0, -20.0]), 0.5, FAR)
    corners = {(103.5, -17.5), (113.0, -17.5), (113.0, -15.0), (103.5, -15.0)}
    assert {(float(x), float(y)) for x, y in polygon.outline} == corners
