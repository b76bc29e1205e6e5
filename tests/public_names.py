"""Public names with their parameters, read off syntax trees: nothing is imported."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from tests.conftest import ROOT

SOURCES = [ROOT / "src", *sorted(ROOT.glob("packages/*/src"))]
PRODUCTS = sorted(folder.parent.name for source in SOURCES for folder in source.glob("*/__init__.py"))
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md")), *sorted(ROOT.glob("examples/*.py"))]
Function = ast.FunctionDef | ast.AsyncFunctionDef


def place(name: str) -> Path | None:
    """The file of a module; None where the name is none of ours."""
    paths = [source.joinpath(*name.split(".")) for source in SOURCES]
    files = [file for path in paths for file in (path / "__init__.py", path.with_suffix(".py"))]
    return next((file for file in files if file.is_file()), None)


def told() -> list[str]:
    """Our modules that pages name."""
    named = re.compile(rf"\b(?:{'|'.join(PRODUCTS)})(?:\.\w+)*")
    words = {word for page in PAGES for word in named.findall(page.read_text())}
    return sorted({found for word in words if (found := _module(word))})


def lines(module: str) -> Iterator[str]:
    """A line for each public name of a module, and for each public method of its classes."""
    for name in sorted(public(module)):
        home, node = found(module, name)
        yield f"{module}.{name}{_taken(home, node)}"
        if isinstance(node, ast.ClassDef):
            methods = [each for each in node.body if isinstance(each, Function)]
            for method in (each for each in methods if not each.name.startswith("_")):
                mark = "" if _marked(method, "property") else f"({', '.join(_parameters(method)[1:])})"
                yield f"{module}.{name}.{method.name}{mark}"


def public(module: str) -> set[str]:
    """What a package passes on of its own modules, or what a module defines, less what begins with ``_``.

    Where an ``__init__`` has imports such as ``from a import b as b``, it passes on these alone, as type
    checkers take it.
    """
    file = _file(module)
    bound = _bound(file)
    aliases = {
        name for name, node in bound.items() if isinstance(node, ast.ImportFrom) and _aliased(node, name)
    }
    named = {
        name
        for name, node in bound.items()
        if not isinstance(node, ast.ImportFrom)
        or name in aliases
        or (file.name == "__init__.py" and not aliases and _inside(module, node))
    }
    return {name for name in named if not name.startswith("_") or name == "__version__"}


def found(module: str, name: str) -> tuple[str, ast.AST]:
    """Where a name is defined, over all that pass it on: the module and the statement."""
    node = _bound(_file(module))[name]
    if isinstance(node, ast.ImportFrom) and _ours(node):
        assert node.module is not None
        original = next(each.name for each in node.names if (each.asname or each.name) == name)
        own = node.module == module
        if place(f"{node.module}.{original}") and (own or original not in _bound(_file(node.module))):
            return f"{node.module}.{original}", ast.Module([], [])
        return found(node.module, original)
    return module, node


@cache
def _bound(file: Path) -> dict[str, ast.stmt]:
    """Names at the top of a module with the statements that bind them, those for type checkers too."""
    body = ast.parse(file.read_text()).body
    body += [inner for node in body if isinstance(node, ast.If) for inner in node.body]
    bound: dict[str, ast.stmt] = {}
    for node in body:
        if isinstance(node, ast.ImportFrom):
            bound |= {each.asname or each.name: node for each in node.names}
        elif isinstance(node, Function | ast.ClassDef):
            bound[node.name] = node
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            flat = [one for each in targets for one in (each.elts if isinstance(each, ast.Tuple) else [each])]
            bound |= {each.id: node for each in flat if isinstance(each, ast.Name)}
    return bound


def _file(module: str) -> Path:
    file = place(module)
    assert file is not None, module
    return file


def _ours(node: ast.ImportFrom) -> bool:
    return (node.module or "").split(".")[0] in PRODUCTS


def _inside(package: str, node: ast.ImportFrom) -> bool:
    return (node.module or "").startswith(f"{package}.")


def _aliased(node: ast.ImportFrom, name: str) -> bool:
    return any(each.name == each.asname == name for each in node.names)


def _module(word: str) -> str | None:
    """The longest module that a dotted name begins with."""
    parts = word.split(".")
    names = [".".join(parts[:count]) for count in range(len(parts), 0, -1)]
    return next((name for name in names if place(name)), None)


def _taken(module: str, node: ast.AST) -> str:
    """Parameters in brackets; nothing of what is no function and no class."""
    if isinstance(node, Function):
        return f"({', '.join(_parameters(node))})"
    if isinstance(node, ast.ClassDef):
        return f"({', '.join(_fields(module, node))})"
    return ""


def _fields(module: str, node: ast.ClassDef) -> list[str]:
    """What making one takes: the parameters of ``__init__``, else the fields, those of our bases first."""
    made = [each for each in node.body if isinstance(each, Function) and each.name == "__init__"]
    if made:
        return _parameters(made[0])[1:]
    above: list[str] = []
    for base in node.bases:
        if isinstance(base, ast.Name) and base.id in _bound(_file(module)):
            home, inner = found(module, base.id)
            above += _fields(home, inner) if isinstance(inner, ast.ClassDef) else []
    own = [each for each in node.body if isinstance(each, ast.AnnAssign)]
    names = [each.target.id for each in own if isinstance(each.target, ast.Name)]
    return above + [name for name in names if not name.startswith("_") and name not in above]


def _parameters(node: Function) -> list[str]:
    given = node.args
    names = [each.arg for each in (*given.posonlyargs, *given.args)]
    names += [f"*{given.vararg.arg}"] if given.vararg else ["*"] if given.kwonlyargs else []
    names += [each.arg for each in given.kwonlyargs]
    return names + ([f"**{given.kwarg.arg}"] if given.kwarg else [])


def _marked(node: Function, decorator: str) -> bool:
    return any(decorator in ast.unparse(each) for each in node.decorator_list)
