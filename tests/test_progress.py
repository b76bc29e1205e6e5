"""Progress: bars in a notebook."""

import sys
from typing import Any

import pytest

from dreamdrive import InputError
from dreamdrive.progress import NotebookBars


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What a notebook shows in the place of the bars, in the order of time."""
    display = pytest.importorskip("IPython.display")
    texts: list[str] = []

    class Place:
        def update(self, html: Any) -> None:
            texts.append(html.data)

    monkeypatch.setattr(display, "display", lambda html, display_id: Place())
    return texts


def test_a_row_for_each_stage_with_what_is_done(shown: list[str]) -> None:
    bars = NotebookBars()
    bars("prior", 1, 1)
    bars("geometry", 0, 0)
    for step in range(5):
        bars("fit", step, 4)
    last = shown[-1]
    assert last.count("<tr>") == 3
    assert '<progress max="4" value="4"></progress>' in last
    assert "<td>geometry</td><td><progress></progress></td>" in last
    # The second and third step came too soon after the first one.
    assert [text for text in shown if 'value="2"' in text or 'value="3"' in text] == []


def test_where_nobody_looks_nothing_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    display = pytest.importorskip("IPython.display")
    monkeypatch.setattr(display, "display", lambda html, display_id: None)
    NotebookBars()("fit", 1, 2)


def test_without_ipython_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "IPython.display", None)
    with pytest.raises(InputError, match=r"dreamdrive\[notebook\]"):
        NotebookBars()
