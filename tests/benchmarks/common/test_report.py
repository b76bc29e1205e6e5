"""Reports on disk, and what is said of failures."""

import argparse
import json
from pathlib import Path

import pytest

from dreamdrive_bench.common.report import as_json, publish, rounded


def test_numbers_keep_six_digits() -> None:
    found = rounded({"a": [1 / 3, 2, None, True, "x"], "b": 123456789.0})
    assert found == {"a": [0.333333, 2, None, True, "x"], "b": 123457000.0}


def test_numbers_of_a_list_share_a_line() -> None:
    report = {"rows": [{"found": [1, 2.5]}], "names": ["a [1,\n 2]"]}
    assert '"found": [ 1, 2.5 ]' in as_json(report)
    assert json.loads(as_json(report)) == report


def test_a_report_is_printed_and_written_and_failures_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = argparse.Namespace(json=tmp_path / "of/all.json", markdown=tmp_path / "all.md")
    assert publish(options, {"rows": [1 / 3]}, "# Rows", ["corner a"]) == 1
    assert json.loads(options.json.read_text()) == {"rows": [0.333333]}
    assert options.markdown.read_text() == "# Rows"
    said = capsys.readouterr()
    assert (said.out, said.err) == ("# Rows\n", "failed: corner a\n")
    assert publish(argparse.Namespace(json=None, markdown=None), {}, "", []) == 0
