"""The pages: links lead somewhere, the README reaches each page, and messages name pages that exist."""

import importlib.util
import re
from pathlib import Path

from tests.public_names import place, public, told

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
MOST_WORDS, MOST_OF_THE_DESIGN = 27_000, 2_500
MADE = re.compile(r"<!-- ([\w-]+): begin -->.*?<!-- \1: end -->", re.DOTALL)
"""What a benchmark writes between its marks."""
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


def words(text: str) -> int:
    """What has a letter or a digit, less what benchmarks write; lines of tables are none."""
    return len(re.findall(r"[^\s|]*\w[^\s|]*", MADE.sub("", text)))


def generated(page: Path) -> bool:
    """Whether a page is made of help texts, docstrings or examples; its top says so, or that of its list."""
    return page.parent.name == "examples" or "\nGenerated from " in page.read_text()[:300]


def test_pages_by_hand_are_short() -> None:
    counts = {page: words(page.read_text()) for page in ROOT.glob("docs/**/*.md") if not generated(page)}
    assert len(counts) > 40
    assert sum(counts.values()) <= MOST_WORDS, sorted(counts.items(), key=lambda item: -item[1])[:10]
    assert counts[ROOT / "docs/design.md"] <= MOST_OF_THE_DESIGN


def test_generated_pages_say_so() -> None:
    found = {page.relative_to(ROOT).as_posix() for page in ROOT.glob("docs/**/*.md") if generated(page)}
    assert {"docs/commands.md", "docs/options.md", "docs/examples/README.md"} <= found
    assert "Generated from" in (ROOT / "docs/examples/README.md").read_text()
    assert {name for name in found if not name.startswith("docs/examples/")} == {
        "docs/commands.md",
        "docs/options.md",
    }


def test_pictures_of_stages_are_small() -> None:
    found = list(ROOT.glob("docs/images/stage_*.jpg"))
    assert len(found) == 8
    assert [file.name for file in found if file.stat().st_size > 80_000] == []
    assert (ROOT / "docs/images/film.webp").stat().st_size <= 2_000_000


def test_the_site_has_a_page_for_each_public_module_with_all_its_names() -> None:
    spec = importlib.util.spec_from_file_location("api", ROOT / "docs/site/api.py")
    assert spec is not None
    assert spec.loader is not None
    api = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(api)
    seen: set[tuple[str, str]] = set()
    for module in told():
        page = api.described(module, seen)
        names = {f"{module}.{name}" for name in public(module) if place(f"{module}.{name}") is None}
        assert [name for name in sorted(names) if f":: {name}\n" not in f"{page}\n"] == [], module
