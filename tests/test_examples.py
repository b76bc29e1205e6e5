"""The examples: twelve programs, of which each docstring is a page. ``make ci`` runs them."""

import re

from tests.example_pages import EXAMPLES, PAGES, docstring, pages
from tests.snapshot import agrees


def test_they_are_numbered() -> None:
    numbers = [int(file.name[:2]) for file in EXAMPLES]
    assert numbers == list(range(1, 13))


def test_each_says_how_it_is_run() -> None:
    for file in EXAMPLES:
        assert f"    python examples/{file.name} " in docstring(file), file.name
        assert re.search(r'"--out", type=Path, default=Path\("out/' + file.stem, file.read_text()), file.name


def test_pages_are_those_of_the_docstrings() -> None:
    made = pages()
    for file, text in made.items():
        agrees(file, text)
    assert set(PAGES.glob("*")) == set(made)
