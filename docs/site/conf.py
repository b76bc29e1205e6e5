"""The documentation as a site, by ``make site``; its root is the project's, where README.md lies."""

import sys
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from docs.site.api import described  # noqa: E402

from tests.public_names import told  # noqa: E402

project = html_title = "DreamDrive"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "README"
include_patterns = [
    "*.md",
    "docs/**.md",
    "docs/api/*.rst",
    "benchmarks/**.md",
    "packages/*/README.md",
    "tests/golden/README.md",
]
exclude_patterns = [".*", "build", "out", "demo", "dist", "runs", "src", "native", "training"]
myst_heading_anchors = 4
html_theme = "furo"
html_extra_path = ["index.html"]
html_show_copyright = html_copy_source = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_use_ivar = True
# A name that several packages pass on has one description to lead to; reports of benchmarks begin at H2.
suppress_warnings = ["ref.python", "myst.header"]

CONTENTS = {
    "Start": ["docs/quickstart", "docs/README", "docs/troubleshooting"],
    "Guides": ["docs/guides/*", "docs/gpu", "docs/examples/README"],
    "Stages": ["docs/stages/*"],
    "Reference": [
        *("docs/commands", "docs/options", "docs/formats", "docs/layout", "docs/replay", "docs/extending"),
        "docs/reference/*",
    ],
    "Python": ["docs/api/*"],
    "Results": ["docs/figures", "docs/results/*", "benchmarks/README", "benchmarks/results/*"],
    "Development": [
        "docs/design",
        "docs/glossary",
        "CONTRIBUTING",
        "CHANGELOG",
        "packages/*/README",
        "tests/golden/README",
    ],
}
"""The navigation: a page that no pattern finds is a mistake, a pattern that finds no page is none."""


def with_contents(app: Sphinx, name: str, source: list[str]) -> None:
    """Navigation below the front page, and examples below the list of them."""
    parts = {root_doc: CONTENTS, "docs/examples/README": {"": ["docs/examples/[0-9]*"]}}.get(name, {})
    for title, patterns in parts.items():
        found = [
            file.relative_to(ROOT).with_suffix("")
            for each in patterns
            for file in sorted(ROOT.glob(f"{each}.*"))
            if file.suffix in (".md", ".rst")
        ]
        pages = [f"/{page}" for page in dict.fromkeys(found)]
        caption = [f":caption: {title}"] if title else []
        source[0] += "\n".join(["", "```{toctree}", ":hidden:", *caption, "", *pages, "```", ""])


def write_api(app: Sphinx) -> None:
    """A page for each public module; those of modules that are none any more go."""
    folder = ROOT / "docs/api"
    folder.mkdir(exist_ok=True)
    seen: set[tuple[str, str]] = set()
    made = {folder / f"{module}.rst": text for module in told() if (text := described(module, seen))}
    for file in set(folder.glob("*.rst")) - set(made):
        file.unlink()
    for file, text in made.items():
        if not file.is_file() or file.read_text() != text:
            file.write_text(text)


def setup(app: Sphinx) -> None:
    """What Sphinx calls."""
    app.connect("builder-inited", write_api)
    app.connect("source-read", with_contents)
