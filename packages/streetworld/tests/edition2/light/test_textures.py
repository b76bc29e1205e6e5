"""Cut textures are read, kept apart for test streets, and change pictures but no truth."""

from dataclasses import replace
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive_train.street_network.data.textures import TextureCut, make_textures
from streetworld.edition2.light.photograph import photograph
from streetworld.edition2.light.textures import TextureLibrary, mirrored_tile
from tests.conftest import ROOT

CUTS = ROOT / "training" / "texture_cuts.json"
SQUARE = [(0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)]


@pytest.fixture
def library(tmp_path: Path) -> TextureLibrary:
    """Ten facades cut from one picture, red in its middle."""
    picture = np.zeros((80, 120, 3), np.uint8)
    picture[20:60, 30:90, 2] = 200
    (tmp_path / "data" / "opensfm").mkdir(parents=True)
    cv2.imwrite(str(tmp_path / "data/opensfm/a.png"), picture)
    cuts = [TextureCut("opensfm/a.png", number, "facade", SQUARE, 8.0) for number in range(10)]
    (tmp_path / "cuts.json").write_bytes(msgspec.json.encode(cuts))
    make_textures(tmp_path / "cuts.json", tmp_path / "data", tmp_path / "textures")
    return TextureLibrary.read(tmp_path / "textures")


def test_a_cut_shows_what_its_corners_hold(library: TextureLibrary) -> None:
    found = library.pick("facade", 0, np.random.default_rng(0))
    assert found is not None
    image, about = found
    np.testing.assert_allclose(image.reshape(-1, 3).mean(axis=0), (200, 0, 0), atol=12)
    assert about.licence == "BSD-2-Clause"
    assert about.width_m == 8.0


def test_damaged_libraries_are_refused(library: TextureLibrary, tmp_path: Path) -> None:
    folder = tmp_path / "textures"
    index = (folder / "index.json").read_text()
    for text, said in (
        ("[{", "is no list of textures"),
        ("[" * 100_000, "is no list of textures"),
        ("[{}]", "missing required field `file`"),
        (index.replace(library.textures[0].file, "../x.jpg"), "is not a plain name"),
        (index.replace(library.textures[0].file, "x.jpg"), "cannot be read"),
    ):
        (folder / "index.json").write_text(text)
        with pytest.raises(InputError, match=said):
            TextureLibrary.read(folder)
    spoilt = replace(library, encoded=(b"no picture",) * len(library.encoded))
    with pytest.raises(InputError, match="is no picture"):
        spoilt.pick(library.textures[0].kind, library.textures[0].number, np.random.default_rng(0))


def test_looks_kept_out_of_training_share_no_texture_with_the_others(library: TextureLibrary) -> None:
    seen: dict[bool, set[int]] = {True: set(), False: set()}
    for look in range(100):
        found = library.pick("facade", look, np.random.default_rng(look))
        assert found is not None
        seen[look % 5 == 4].add(found[1].number)
    assert seen[True] == {4, 9}
    assert seen[False] == {0, 1, 2, 3, 5, 6, 7, 8}


def test_a_kind_that_is_missing_is_none(library: TextureLibrary) -> None:
    assert library.pick("sky", 0, np.random.default_rng(0)) is None


def test_a_folder_without_textures_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"has no index\.json"):
        TextureLibrary.read(tmp_path)


def test_pictures_of_unknown_licence_are_refused(tmp_path: Path) -> None:
    (tmp_path / "cuts.json").write_bytes(
        msgspec.json.encode([TextureCut("other/a.png", 0, "sky", SQUARE, 8.0)])
    )
    with pytest.raises(InputError, match="textures are cut from"):
        make_textures(tmp_path / "cuts.json", tmp_path, tmp_path / "out")


def test_the_list_of_cuts_has_enough_of_every_kind() -> None:
    cuts = msgspec.json.decode(CUTS.read_bytes(), type=list[TextureCut])
    for kind, least in {"facade": 100, "road": 60, "vegetation": 60, "sky": 60, "ground": 40}.items():
        assert sum(cut.kind == kind for cut in cuts) >= least
    assert not any("pandaset" in cut.picture for cut in cuts)


def test_a_mirrored_tile_has_no_seam() -> None:
    image = np.random.default_rng(0).integers(0, 255, (6, 5, 3)).astype(np.uint8)
    tile = mirrored_tile(image)
    np.testing.assert_array_equal(tile[0], tile[-1])
    np.testing.assert_array_equal(tile[:, 0], tile[:, -1])


def test_photographs_differ_by_seed_and_keep_edges_in_place() -> None:
    frame = np.zeros((60, 100, 3), np.uint8)
    frame[:, 50:] = 200
    taken = [photograph(frame, seed) for seed in range(12)]
    assert len({picture.tobytes() for picture in taken}) == 12
    np.testing.assert_array_equal(taken[3], photograph(frame, 3))
    for picture in taken:
        row = picture.mean(axis=(0, 2))
        assert abs(np.argmax(np.abs(np.diff(row))) - 49) <= 2
