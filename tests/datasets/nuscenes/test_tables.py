"""Rows of tables by a field, whatever is damaged around them."""

import json
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from dreamdrive.datasets.nuscenes.tables import SampleRow, Tables

Rows = list[dict[str, object]]


def tables(folder: Path, rows: Rows) -> Tables:
    (folder / "sample.json").write_text(json.dumps(rows))
    return Tables(folder, folder)


def row(token: str, scene: object) -> dict[str, object]:
    return {"token": token, "timestamp": 1, "scene_token": scene}


@given(
    scenes=st.lists(st.sampled_from([*"abcd", 7, None]), max_size=12),
    keys=st.sets(st.sampled_from([*"abcde"]), max_size=3),
)
def test_rows_by_a_field_are_those_of_a_search(
    scenes: list[object], keys: set[str], tmp_path_factory: pytest.TempPathFactory
) -> None:
    given_rows = [row(f"t{k}", scene) for k, scene in enumerate(scenes)]
    made = tables(tmp_path_factory.mktemp("t"), given_rows)
    found = made.rows("sample", SampleRow, "scene_token", keys)
    assert list(found) == [each["token"] for each in given_rows if each["scene_token"] in keys]
    wrong = sum(not isinstance(scene, str) for scene in scenes)
    assert made.problems == () if not wrong else f"left out ({wrong}, the first: row " in made.problems[0]


def test_a_table_that_was_changed_is_read_again(tmp_path: Path) -> None:
    made = tables(tmp_path, [row("t0", "a")])
    assert list(made.rows("sample", SampleRow, "scene_token", {"a"})) == ["t0"]
    made = tables(tmp_path, [row("t1", "a"), row("t2", "b")])
    assert list(made.rows("sample", SampleRow, "scene_token", {"a"})) == ["t1"]


def test_tokens_that_stand_twice_are_told_once_each(tmp_path: Path) -> None:
    made = tables(tmp_path, [row("t0", "a"), row("t0", "a"), row("t0", "b")])
    assert list(made.rows("sample", SampleRow, "scene_token", {"a"})) == ["t0"]
    assert made.problems == ("sample.json: tokens stand twice; their first rows count (1, the first: t0)",)
