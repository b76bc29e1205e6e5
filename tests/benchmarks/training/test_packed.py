"""Packs: what is carried comes out again, and no more than may be carried goes in."""

import io
import json
import subprocess
import tarfile
import zipfile

import cv2
import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive_bench.training.packed import PACKAGES, as_carried, packed, save_pack, unpack, with_packages


@pytest.fixture
def folder(tmp_path):
    """A picture as JPEG, one as PNG and a text, with a hidden file beside them."""
    made = tmp_path / "made"
    (made / "inner").mkdir(parents=True)
    small = np.random.default_rng(0).integers(0, 255, (6, 9, 3), np.uint8)
    picture = cv2.resize(small, (72, 48), interpolation=cv2.INTER_CUBIC)
    cv2.imwrite(str(made / "inner/a.jpg"), picture, [cv2.IMWRITE_JPEG_QUALITY, 95])
    cv2.imwrite(str(made / "inner/b.png"), picture)
    (made / "records.jsonl").write_text("{}\n")
    (made / ".dreamdrive.json").write_text("{}")
    return made


def files(folder):
    found = (each for each in folder.rglob("[!.]*") if each.is_file())
    return {each.relative_to(folder).as_posix(): each.read_bytes() for each in found}


def test_a_pack_without_a_quality_gives_back_every_byte(folder, tmp_path):
    save_pack(tmp_path / "pack", {"one": folder, "two": folder / "inner"}, {"of": "test"})
    assert unpack(tmp_path / "pack", tmp_path / "out") == {"of": "test", "quality": None}
    assert files(tmp_path / "out/one") == files(folder)
    assert files(tmp_path / "out/two") == files(folder / "inner")
    assert packed({"one": folder}, {}) == packed({"one": folder}, {})


def test_pictures_come_out_as_what_is_made_elsewhere_goes_through(folder, tmp_path):
    (tmp_path / "pack").write_bytes(packed({"one": folder}, {}, 60))
    assert len(packed({"one": folder}, {}, 20)) < len(packed({"one": folder}, {}))
    unpack(tmp_path / "pack", tmp_path / "out")
    drawn = cv2.imread(str(folder / "inner/b.png"))[..., ::-1]
    there = as_carried(drawn, 60)
    assert 1 < np.abs(there.astype(int) - drawn).mean() < 20
    expected = cv2.imencode(".jpg", np.ascontiguousarray(there[..., ::-1]), [cv2.IMWRITE_JPEG_QUALITY, 95])[1]
    out = files(tmp_path / "out/one")
    assert out["inner/a.jpg"] == expected.tobytes()
    assert out["inner/b.png"] == files(folder)["inner/b.png"]


def test_what_is_there_stays(folder, tmp_path):
    save_pack(tmp_path / "pack", {"one": folder}, {})
    (tmp_path / "out/one").mkdir(parents=True)
    (tmp_path / "out/one/mine").write_text("mine")
    unpack(tmp_path / "pack", tmp_path / "out")
    assert files(tmp_path / "out/one") == {"mine": b"mine"}


def test_pictures_are_as_good_as_there_is_room_for(folder, tmp_path):
    sizes = {quality: len(packed({"one": folder}, {}, quality)) for quality in (None, 90, 30)}
    for quality in (None, 90):
        kept = save_pack(tmp_path / "pack", {"one": folder}, {}, sizes[quality])
        assert kept == (sizes[quality], quality)
        assert (tmp_path / "pack").stat().st_size == sizes[quality]
        (tmp_path / "pack").unlink()
    with pytest.raises(InputError, match=r"would take 0\.0 MB; expected 0\.00"):
        save_pack(tmp_path / "pack", {"one": folder}, {}, sizes[30] - 4)
    assert not (tmp_path / "pack").exists()


def test_packages_are_carried_for_tar_alone(folder, tmp_path):
    with pytest.raises(InputError, match="no wheels"):
        with_packages(folder, tmp_path)
    assert with_packages(None, tmp_path) == {}
    with zipfile.ZipFile(folder / "a-1-py3-none-any.whl", "w") as wheel:
        wheel.writestr("a/__init__.py", "A = 1\n")
    save_pack(tmp_path / "pack", {"inner": folder / "inner"} | with_packages(folder, tmp_path), {})
    unpack(tmp_path / "pack", tmp_path / "out")
    assert [each.name for each in (tmp_path / "out").iterdir()] == ["inner"]
    subprocess.run(["tar", "-xJf", tmp_path / "pack", "-C", tmp_path / "out", PACKAGES], check=True)
    assert (tmp_path / "out/packages/a/__init__.py").read_text() == "A = 1\n"


def test_a_pack_leads_to_no_place_outside(tmp_path):
    with tarfile.open(tmp_path / "pack", "w:xz") as archive:
        for name, content in (("pack.json", json.dumps({"quality": None}).encode()), ("one/../../b", b"b")):
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    with pytest.raises(tarfile.OutsideDestinationError):
        unpack(tmp_path / "pack", tmp_path / "out")
    assert not list(tmp_path.rglob("b"))
