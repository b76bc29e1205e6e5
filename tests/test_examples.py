"""The examples: twelve programs and a notebook, of which each has a page. ``make ci`` runs them."""

import re
from pathlib import Path

import pytest

from tests.example_pages import EXAMPLES, NOTEBOOKS, PAGES, cells, docstring, pages
from tests.snapshot import agrees


def test_they_are_numbered() -> None:
    numbers = [int(file.name[:2]) for file in EXAMPLES]
    assert numbers == list(range(1, 13))
    assert [int(file.name[:2]) for file in NOTEBOOKS] == [13]


def test_each_says_how_it_is_run() -> None:
    for file in EXAMPLES:
        assert f"    python examples/{file.name} " in docstring(file), file.name
        assert re.search(r'"--out", type=Path, default=Path\("out/' + file.stem, file.read_text()), file.name


def test_pages_are_those_of_the_docstrings() -> None:
    made = pages()
    for file, text in made.items():
        agrees(file, text)
    assert set(PAGES.glob("*")) == set(made)


def test_notebooks_hold_no_results() -> None:
    code = [cell for file in NOTEBOOKS for cell in cells(file) if cell["cell_type"] == "code"]
    assert len(code) > 4
    assert [cell for cell in code if cell["outputs"] or cell["execution_count"]] == []


@pytest.mark.slow
@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_notebooks_run_and_show_what_they_make(file: Path, tmp_path: Path) -> None:
    import nbformat
    from nbclient import NotebookClient

    book = nbformat.read(file, as_version=4)
    NotebookClient(
        book, timeout=300, kernel_name="python3", resources={"metadata": {"path": tmp_path}}
    ).execute()
    shown = [
        each["data"]["text/html"]
        for cell in book.cells
        for each in cell.get("outputs", [])
        if "text/html" in each.get("data", {})
    ]
    assert sum("data:image/jpeg;base64" in html for html in shown) == 4  # outcome, scene, trajectory, look
    assert any("<progress" in html and "<td>fit</td>" in html for html in shown)
    assert (tmp_path / "out" / file.stem / "report.json").is_file()
