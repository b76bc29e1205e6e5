"""Pages of the documentation that are the docstrings of the examples."""

import ast
import json
from pathlib import Path
from typing import Any

from tests.conftest import ROOT

EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))
NOTEBOOKS = sorted((ROOT / "examples").glob("[0-9]*.ipynb"))
PAGES = ROOT / "docs/examples"


def pages() -> dict[Path, str]:
    """All pages by their files: one for each example, and the list of them."""
    rows = [f"| [{file.stem}]({file.stem}.md) | {title(file)} |" for file in (*EXAMPLES, *NOTEBOOKS)]
    head = [
        "# Examples",
        "",
        "Generated from the examples by `make snapshots`. Each runs as it is: without an input",
        "[small.py](../../examples/small.py) makes a small one. `make ci` runs them all.",
        "",
        "| example | what it shows |",
        "| --- | --- |",
    ]
    made = {PAGES / f"{file.stem}.md": page(file) for file in EXAMPLES}
    made |= {PAGES / f"{file.stem}.md": notebook_page(file) for file in NOTEBOOKS}
    return {PAGES / "README.md": "\n".join([*head, *rows]) + "\n"} | made


def page(file: Path) -> str:
    """The docstring as text, and below it the program."""
    _, _, rest = docstring(file).partition("\n\n")
    code = file.read_text().partition('"""\n\n')[2]
    name = f"examples/{file.name}"
    return f"# {title(file)}\n\n{rest}\n\n[`{name}`](../../{name}):\n\n```python\n{code}```\n"


def notebook_page(file: Path) -> str:
    """The cells: text as it is, code as programs. What they show is to be seen in a notebook."""
    blocks = ["".join(cell["source"]) for cell in cells(file)]
    kinds = [cell["cell_type"] for cell in cells(file)]
    name = f"examples/{file.name}"
    link = f"[`{name}`](../../{name})"
    parts = [
        f"```python\n{text}\n```" if kind == "code" else text
        for text, kind in zip(blocks, kinds, strict=True)
    ]
    return "\n\n".join([parts[0], f"{link}:", *parts[1:]]) + "\n"


def cells(file: Path) -> list[dict[str, Any]]:
    """The cells of a notebook."""
    return json.loads(file.read_text())["cells"]


def title(file: Path) -> str:
    """The first line of the docstring, or of a notebook's text."""
    if file.suffix == ".ipynb":
        return cells(file)[0]["source"][0].removeprefix("# ").strip()
    return docstring(file).partition("\n")[0].removesuffix(".")


def docstring(file: Path) -> str:
    """What the module says of itself."""
    text = ast.get_docstring(ast.parse(file.read_text()))
    assert text is not None, file
    return text
