import json
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest

from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive_train.street_network.data.labelled import LabelledOptions, labelled_records
from dreamdrive_train.street_network.data.records import UNKNOWN, Record

SKY = {"class": "sky", "points": [[0, 0], [199, 0], [199, 40], [0, 40]]}
ROAD = {"class": "road", "points": [[0, 41], [199, 41], [199, 99], [0, 99]]}
CAR = {"class": "vehicle", "points": [[80, 30], [120, 30], [120, 60], [80, 60]]}


def picture(name: str = "a", **changes: object) -> dict[str, object]:
    return {
        "image": f"made/{name}.png",
        "size": [200, 100],
        "horizon": [40, 40],
        "lens": "plain",
        "shapes": [SKY, ROAD, CAR],
    } | changes


def convert(
    folder: Path, *pictures: dict[str, object], options: LabelledOptions | None = None
) -> list[Record]:
    (folder / "made").mkdir()
    for each in pictures:
        image = np.full((100, 200, 3), 100, np.uint8)
        image[80:83] = 200
        cv2.imwrite(str(folder / str(each["image"])), image)
    labels = folder / "made.json"
    labels.write_text(json.dumps({"source": "made", "licence": "MIT", "pictures": pictures}))
    return labelled_records(labels, folder, folder / "out", options or LabelledOptions())


def planes(folder: Path, record: Record) -> tuple[np.ndarray, np.ndarray]:
    assert record.labels is not None
    encoded = cv2.imread(str(folder / "out" / record.labels))
    assert encoded is not None
    return encoded[..., 2], encoded[..., 1]


def depth_of(folder: Path, record: Record) -> np.ndarray:
    assert record.depth is not None
    depth = cv2.imread(str(folder / "out" / record.depth), cv2.IMREAD_UNCHANGED)
    assert depth is not None
    return depth / 256


def test_the_inside_of_outlines_is_labelled_and_their_borders_are_unknown(tmp_path: Path):
    (record,) = convert(tmp_path, picture())
    labels, instances = planes(tmp_path, record)
    assert labels[20, 20] == StreetClass.SKY
    assert labels[60, 20] == StreetClass.ROAD
    assert (labels[38:43, 20] == UNKNOWN).all()
    assert (labels[45, 81:120] == StreetClass.VEHICLE).all()
    assert labels[45, 80] == labels[45, 79] == UNKNOWN
    assert labels[45, 78] != UNKNOWN
    assert instances[45, 100] == 1
    assert instances[60, 20] == 0


def test_a_bright_line_on_the_road_may_be_a_marking(tmp_path: Path):
    (record,) = convert(tmp_path, picture())
    labels, _ = planes(tmp_path, record)
    assert (labels[80:83, 20] == 32).all()
    assert labels[88, 20] == StreetClass.ROAD


def test_void_is_unknown_and_takes_nothing_from_its_neighbours(tmp_path: Path):
    void = {"class": "void", "points": [[0, 41], [30, 41], [30, 99], [0, 99]]}
    (record,) = convert(tmp_path, picture(shapes=[SKY, ROAD, void]))
    labels, instances = planes(tmp_path, record)
    assert (labels[60, :31] == UNKNOWN).all()
    assert (instances[60, :31] == UNKNOWN).all()
    assert labels[60, 31] == StreetClass.ROAD


def test_depth_falls_off_with_the_rows_below_the_horizon(tmp_path: Path):
    (record,) = convert(tmp_path, picture())
    depth = depth_of(tmp_path, record)
    assert depth[50, 20] / depth[90, 20] == pytest.approx(5, rel=0.01)
    assert (depth[:42] == 0).all()
    assert depth[55, 100] == pytest.approx(depth[60, 20], rel=0.01)
    assert depth[35, 100] == 0
    assert np.median(depth[63:][depth[63:] > 0]) < 10 < depth[45, 20]


def test_the_foot_of_a_vehicle_seen_askew_gives_each_column_its_own_depth(tmp_path: Path):
    car = CAR | {"foot": [[80, 50], [120, 60]]}
    (record,) = convert(tmp_path, picture(shapes=[SKY, ROAD, car]))
    depth = depth_of(tmp_path, record)
    assert depth[48, 80] == pytest.approx(2 * depth[48, 120], rel=0.01)


@pytest.mark.parametrize("changes", [{"horizon": None}, {"lens": "wide"}, {"flat": False}])
def test_there_is_no_depth_without_a_horizon_a_plain_lens_and_a_flat_road(tmp_path: Path, changes: dict):
    (record,) = convert(tmp_path, picture(**changes))
    assert record.depth is None
    assert (record.horizon_px is None) == (changes.get("horizon", 0) is None)
    assert record.distorted == (changes.get("lens") == "wide")


def test_a_horizon_that_rises_to_the_right_is_a_camera_turned_clockwise(tmp_path: Path):
    (record,) = convert(tmp_path, picture(horizon=[50, 30]))
    assert record.roll_rad == pytest.approx(np.arctan(0.1))
    assert record.horizon_px == pytest.approx(-10)


def test_larger_pictures_are_reduced_with_their_outlines_and_horizon(tmp_path: Path):
    (record,) = convert(tmp_path, picture(), options=LabelledOptions(long_side_px=100, region_band_px=1))
    labels, _ = planes(tmp_path, record)
    assert labels.shape == (50, 100)
    assert record.horizon_px == pytest.approx(-5)
    assert (labels[23, 41:59] == StreetClass.VEHICLE).all()


def test_a_mask_keeps_its_edges_and_outlines_only_cut_its_road_users(tmp_path: Path):
    mask = np.full((100, 200, 3), (0x60, 0x80, 0x80), np.uint8)
    mask[50:] = (0x20, 0x20, 0x40)
    mask[35:60, 90:160] = (0x66, 0xFF, 0x00)
    cv2.imwrite(str(tmp_path / "mask.png"), mask)
    (record,) = convert(tmp_path, picture(shapes=[CAR], mask="mask.png"))
    labels, instances = planes(tmp_path, record)
    assert labels[20, 20] == 36
    assert labels[90, 20] == StreetClass.ROAD
    assert (labels[45, 90:120] == StreetClass.VEHICLE).all()
    assert (instances[45, 90:120] == 1).all()
    assert (labels[45, 121:160] == 34).all()
    assert (instances[45, 121:160] == UNKNOWN).all()
    assert labels[45, 85] == 36


def test_one_group_of_eight_is_kept_out_with_all_its_pictures(tmp_path: Path):
    records = convert(tmp_path, *(picture(f"{i:02d}", group=f"g{i // 2}") for i in range(18)))
    assert [i for i, record in enumerate(records) if record.kept_out] == [14, 15]


def test_an_unknown_class_is_named_with_those_known(tmp_path: Path):
    with pytest.raises(msgspec.ValidationError, match="'tram'; known are sky, road"):
        convert(tmp_path, picture(shapes=[CAR | {"class": "tram"}]))


def test_outlines_for_another_size_are_refused(tmp_path: Path):
    with pytest.raises(ValueError, match="is 200x100, its outlines are for"):
        convert(tmp_path, picture(size=[100, 200]))
