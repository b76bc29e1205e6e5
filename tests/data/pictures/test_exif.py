"""What a photo says of itself."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from PIL.TiffImagePlugin import IFDRational

from dreamdrive.data.photo import read_photo
from dreamdrive.data.pictures.exif import PhotoFacts, read_exif


def photo(path: Path, focal: object = None, place: dict[int, object] | None = None) -> Path:
    told = Image.Exif()
    if focal is not None:
        told.get_ifd(0x8769)[0xA405] = focal
    if place is not None:
        told.get_ifd(0x8825).update(place)
    picture = np.random.default_rng(0).integers(0, 255, (270, 480, 3)).astype(np.uint8)
    Image.fromarray(picture).save(path, exif=told)
    return path


def test_focal_length_and_place_are_read(tmp_path: Path) -> None:
    degrees = tuple(IFDRational(x) for x in (52, 30, 36))
    place = {1: "S", 2: degrees, 3: "E", 4: degrees, 17: IFDRational(255, 2)}
    path = photo(tmp_path / "a.jpg", 26, place)
    facts = read_exif(path)
    assert facts.focal_35_mm == 26
    assert facts.latitude_deg == pytest.approx(-52.51)
    assert facts.longitude_deg == pytest.approx(52.51)
    assert facts.heading_deg == pytest.approx(127.5)
    read = read_photo(path, (480, 270))
    assert read.hfov
    assert not read.calibrated
    # 26 mm of a diagonal of 43.27 mm, on one of 550.7 pixels.
    assert read.camera.fx_px == pytest.approx(26 / 43.267 * 550.73, rel=1e-3)
    assert any("26 mm" in note for note in read.notes)
    assert any("-52.51000, 52.51000, heading 128" in note for note in read.notes)


def test_what_the_user_tells_counts_more(tmp_path: Path) -> None:
    path = photo(tmp_path / "a.jpg", 26)
    assert read_photo(path, (480, 270), hfov_deg=90.0).camera.fx_px == pytest.approx(240)


@pytest.mark.parametrize("focal", [0, 5000, None])
def test_what_means_nothing_tells_nothing(tmp_path: Path, focal: int | None) -> None:
    path = photo(tmp_path / "a.jpg", focal, {2: (IFDRational(1, 0),) * 3, 4: 7})
    assert read_exif(path) == PhotoFacts()
    assert not read_photo(path, (480, 270)).hfov


def test_a_file_that_is_no_photo_tells_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    path.write_bytes(b"no photo")
    assert read_exif(path) == PhotoFacts()


@pytest.mark.filterwarnings("error")
def test_damage_in_what_a_photo_says_is_no_error_and_no_warning(tmp_path: Path) -> None:
    data = photo(tmp_path / "a.jpg", 26, {1: "N", 2: (48.0, 8.0, 30.5), 17: 90.0}).read_bytes()
    rng = np.random.default_rng(0)
    for place in range(20, 200):
        spoilt = bytearray(data)
        spoilt[place : place + 4] = rng.bytes(4)
        (tmp_path / "b.jpg").write_bytes(spoilt)
        assert isinstance(read_exif(tmp_path / "b.jpg"), PhotoFacts)
