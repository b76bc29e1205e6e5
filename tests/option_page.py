"""docs/options.md, from the classes of the options."""

import inspect
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

from dreamdrive.options import Options
from dreamdrive.run.options_file import ELSEWHERE
from tests.conftest import ROOT

PAGE = ROOT / "docs/options.md"
HEAD = """# Options

Generated from the docstrings of the options by `make snapshots`: change these.

`dreamdrive generate --options own.toml` sets any constant of any stage. What the file does not name keeps the
value of `--quality`; flags such as `--representation` count more than the file. `report.json` holds all
values that a result was made with. What single options are worth: [ablation.md](results/ablation.md).

```toml
representation = "hybrid"

[geometry]
camera_height_m = 1.7

[fit]
steps = 1200

[score]
window = "none"   # stands for no value, which TOML has no word for
```

A wrong name is answered with the nearest right ones. Values are those of `standard`.
"""


def page() -> str:
    """The page, with a part for each table of the file."""
    return "\n\n".join([HEAD.strip(), *parts("", Options())]) + "\n"


def parts(table: str, options: Any) -> Iterator[str]:
    """The part of a table, then those of the tables inside it."""
    texts = attributes(type(options))
    inner = {each.name: getattr(options, each.name) for each in fields(options)}
    rows = [
        f"| `{name}` | {shown(value)} | {texts[name]} |"
        for name, value in inner.items()
        if not is_dataclass(value) and f"{table}.{name}".strip(".") not in ELSEWHERE
    ]
    about = (inspect.getdoc(type(options)) or "").partition("\n\n")[0].partition("; ")[0].removesuffix(".")
    head = (
        f"## `[{table}]`\n\n{' '.join(about.split())} (`{type(options).__name__}`)."
        if table
        else "## Above all tables"
    )
    if rows:
        yield "\n".join([head, "", "| option | value | what |", "| --- | --- | --- |", *rows])
    for name, value in inner.items():
        if is_dataclass(value):
            yield from parts(f"{table}.{name}".strip("."), value)


def shown(value: object) -> str:
    """As a file would have it."""
    if value is None:
        return '`"none"`'
    return f"`{str(value).lower()}`" if isinstance(value, bool) else f"`{value}`"


def attributes(kind: type) -> dict[str, str]:
    """What each field is, from the docstring of its class."""
    told = (inspect.getdoc(kind) or "").partition("Attributes:\n")[2]
    found = re.findall(r"^    (\w+): (.*(?:\n {8}.*)*)", told, re.MULTILINE)
    return {name: " ".join(text.split()).replace("``", "`").replace("|", "\\|") for name, text in found}
