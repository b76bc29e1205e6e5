"""Tables, cells, and sections written anew."""

from pathlib import Path

import pytest

from dreamdrive_bench.common.markdown import columns, laid_out, number, replace_section, span, table


def test_each_column_is_filled_by_its_function() -> None:
    cells = {"name": lambda row: row[0], "m": lambda row: number(row[1])}
    rows = [("car", 1.234), ("van", None)]
    assert laid_out(cells, rows, table) == "| name | m |\n| --- | --- |\n| car | 1.23 |\n| van | - |"
    assert laid_out(cells, rows, columns) == "name     m\ncar   1.23\nvan      -"
    assert laid_out(cells, [], table) == ""


def test_an_interval_without_bounds_is_left_out() -> None:
    assert span(-0.1, 0.25, "+.1f") == " (-0.1 to +0.2)"
    assert span(None, None) == ""


def test_a_section_is_replaced_and_the_rest_kept(tmp_path: Path):
    file = tmp_path / "page.md"
    file.write_text("before\n<!-- x: begin -->\nold\n<!-- x: end -->\nafter\n")
    replace_section(file, "x", "new \\1\n")
    assert file.read_text() == "before\n<!-- x: begin -->\nnew \\1\n<!-- x: end -->\nafter\n"
    with pytest.raises(SystemExit, match="has no lines <!-- y: begin -->"):
        replace_section(file, "y", "new")
