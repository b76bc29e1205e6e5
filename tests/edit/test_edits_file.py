"""Edits on disk: read as written, refused where they are none."""

import json
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from dreamdrive import load_scene
from dreamdrive.edit import (
    EDITS,
    Copy,
    Delay,
    Edit,
    Edits,
    Insert,
    Move,
    Recolour,
    Remove,
    Speed,
    Turn,
    digest_of_scene,
    read_edits,
    write_edited,
)
from dreamdrive.errors import InputError
from dreamdrive.stored import save_scene
from tests.scene.scenes import make_scene

ids, metres, share = st.integers(0, 9), st.floats(-9, 9), st.floats(0, 1)
any_edit: st.SearchStrategy[Edit] = st.one_of(
    st.builds(Remove, ids),
    st.builds(Move, ids, metres, metres),
    st.builds(Turn, ids, st.floats(-360, 360)),
    st.builds(Delay, ids, metres),
    st.builds(Speed, ids, st.floats(0.01, 100)),
    st.builds(Copy, ids, metres, metres),
    st.builds(Insert, ids, st.text(max_size=9), st.text(max_size=9), metres, metres, st.none() | metres),
    st.builds(Recolour, ids, st.tuples(share, share, share)),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("edits")
    save_scene(make_scene(), made / "scene")
    write_edited(make_scene(), Edits("ab", (Move(0, 1.0, 2.0),)), made / "edited")
    return made


@given(st.lists(any_edit, max_size=3))
def test_what_is_written_is_read(edits: list[Edit]) -> None:
    from dreamdrive.edit import edits_file

    told = json.loads(json.dumps(edits_file._told(Edits("ab", tuple(edits)))))
    stored = edits_file.of_type(told, edits_file._Stored, "it")
    assert tuple(stored.edits) == tuple(edits)


def test_the_folder_holds_the_scene_and_its_edits(folder: Path) -> None:
    assert read_edits(folder / "edited" / EDITS) == Edits("ab", (Move(0, 1.0, 2.0),))
    assert len(load_scene(folder / "edited" / "scene").actors) == 1
    assert digest_of_scene(folder / "edited" / "scene") != digest_of_scene(folder / "scene") != ""
    with pytest.raises(InputError, match="exists already"):
        write_edited(make_scene(), Edits("ab", ()), folder / "edited")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"format": "other"}, "holds no edits"),
        ({"version": 2}, "holds no edits"),
        ({"edits": [{"kind": "explode", "actor": 0}]}, "explode"),
        ({"edits": [{"kind": "remove"}]}, "actor"),
        ({"edits": [{"kind": "remove", "actor": -1}]}, ">= 0"),
        ({"edits": [{"kind": "speed", "actor": 1, "factor": 0}]}, ">= 0.01"),
        ({"edits": [{"kind": "move", "actor": 1, "ahead_m": 1e9, "left_m": 0}]}, "<= 1000"),
        ({"edits": [{"kind": "remove", "actor": 1, "more": 1}]}, "more"),
    ],
)
def test_what_is_no_edit_is_refused(
    folder: Path, tmp_path: Path, change: dict[str, object], said: str
) -> None:
    values = json.loads((folder / "edited" / EDITS).read_text())
    (tmp_path / EDITS).write_text(json.dumps(values | change))
    with pytest.raises(InputError, match=said):
        read_edits(tmp_path / EDITS)


def test_the_last_ones_are_taken_back() -> None:
    edits = Edits("ab", (Remove(1), Remove(2))).and_then((Remove(3),))
    assert edits.less(2).edits == (Remove(1),)
    with pytest.raises(InputError, match="--undo 4: there are 3 edits"):
        edits.less(4)
