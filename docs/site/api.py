"""Pages of the public modules, for autodoc: what ``tests/snapshots/public_names.txt`` lists."""

import ast
from itertools import pairwise

from tests.public_names import found, place, public

FUNCTION = ast.FunctionDef | ast.AsyncFunctionDef


def described(module: str, seen: set[tuple[str, str]]) -> str:
    """The page of a module; nothing of one without public names. Links lead to where a name is seen first."""
    parts = [text for name in sorted(public(module)) if (text := _name(module, name, seen))]
    if not parts:
        return ""
    head = [f"{module}\n{'=' * len(module)}", f".. automodule:: {module}\n   :no-index:"]
    return "\n\n".join([*head, *parts]) + "\n"


def _name(module: str, name: str, seen: set[tuple[str, str]]) -> str:
    home, node = found(module, name)
    again = "\n   :no-index:" if (home, name) in seen else ""
    seen.add((home, name))
    if isinstance(node, ast.ClassDef):
        return f".. autoclass:: {module}.{name}\n   :members:{again}"
    if isinstance(node, FUNCTION):
        return f".. autofunction:: {module}.{name}{again}"
    if isinstance(node, ast.Module):
        return ""
    return f".. py:data:: {module}.{name}{again}\n\n   {_below(home, name)}"


def _below(module: str, name: str) -> str:
    """The text in quotes below a constant."""
    file = place(module)
    assert file is not None
    body = ast.parse(file.read_text()).body
    for node, after in pairwise(body):
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        is_it = any(isinstance(each, ast.Name) and each.id == name for each in targets)
        if is_it and isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
            return " ".join(str(after.value.value).split())
    return ""
