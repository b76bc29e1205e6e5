"""The pages: links lead somewhere, the README reaches each page, and messages name pages that exist."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
LINK = re.compile(r"\]\(([^()\s]+)\)")


def pages() -> list[Path]:
    return sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("benchmarks/*.md")])


def links(page: Path) -> list[tuple[Path, str]]:
    """Files of this project that a page links to, and the heading in them, if any."""
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    near = [target for target in LINK.findall(text) if ":" not in target]
    parts = [target.partition("#") for target in near]
    return [((page.parent / name).resolve() if name else page, heading) for name, _, heading in parts]


def headings(page: Path) -> set[str]:
    """Names of the headings of a page as links have them."""
    lines = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", line.lower()).replace(" ", "-") for line in lines}


def test_links_lead_somewhere() -> None:
    found = [(page, *link) for page in pages() for link in links(page)]
    assert len(found) > 50
    assert [str(target) for _, target, _ in found if not target.exists()] == []
    named = [(target, heading) for _, target, heading in found if heading]
    assert [(str(target), heading) for target, heading in named if heading not in headings(target)] == []


def test_every_page_is_reached_from_the_readme() -> None:
    reached, waiting = {README}, [README]
    while waiting:
        near = {target for target, _ in links(waiting.pop()) if target.suffix == ".md"} - reached
        reached |= near
        waiting += near
    assert [page.name for page in pages() if page not in reached] == []


def test_pages_that_the_program_names_are_there() -> None:
    sources = [*ROOT.glob("src/**/*.py"), *ROOT.glob("benchmarks/**/*.py"), ROOT / "CHANGELOG.md"]
    named = {name for file in sources for name in re.findall(r"docs/[\w/]+\.md", file.read_text())}
    assert "docs/layout.md" in named
    assert sorted(name for name in named if not (ROOT / name).exists()) == []
