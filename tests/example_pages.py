"""Pages of the documentation that are the docstrings of the examples."""

import ast
from pathlib import Path

from tests.conftest import ROOT

EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))
PAGES = ROOT / "docs/examples"


def pages() -> dict[Path, str]:
    """All pages by their files: one for each example, and the list of them."""
    rows = [f"| [{file.stem}]({file.stem}.md) | {title(file)} |" for file in EXAMPLES]
    head = [
        "# Examples",
        "",
        "Each runs as it is: without an input [small.py](../../examples/small.py) makes a small one.",
        "`make ci` runs them all.",
        "",
        "| example | what it shows |",
        "| --- | --- |",
    ]
    return {PAGES / "README.md": "\n".join([*head, *rows]) + "\n"} | {
        PAGES / f"{file.stem}.md": page(file) for file in EXAMPLES
    }


def page(file: Path) -> str:
    """The docstring as text, and below it the program."""
    _, _, rest = docstring(file).partition("\n\n")
    code = file.read_text().partition('"""\n\n')[2]
    name = f"examples/{file.name}"
    return f"# {title(file)}\n\n{rest}\n\n[`{name}`](../../{name}):\n\n```python\n{code}```\n"


def title(file: Path) -> str:
    """The first line of the docstring."""
    return docstring(file).partition("\n")[0].removesuffix(".")


def docstring(file: Path) -> str:
    """What the module says of itself."""
    text = ast.get_docstring(ast.parse(file.read_text()))
    assert text is not None, file
    return text
