"""The rules of the folders of ``src/dreamdrive``, held over its syntax trees."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.conftest import ROOT

SRC = ROOT / "src"
HOUSE = SRC / "dreamdrive"
FILES = sorted(HOUSE.rglob("*.py"))
OPEN = {"scene", "files", "data"}
"""Packages whose modules others import one by one."""
BACKENDS = "dreamdrive.geometry.backends"
WITH_AN_EXTRA = {"dreamdrive.prior.vista.convert", "dreamdrive.prior.vista.features"}
"""They need packages that are not always there, so that no ``__init__`` can name them."""
SHARED = {"dreamdrive.geometry.backends.files", "dreamdrive.geometry.backends.dust3r.align"}
"""No backends: what the user gives, which all take, and the geometry of pointmaps, which two share."""
MOST_LOOSE, MOST_LINES, MOST_OF_A_FUNCTION = 10, 400, 50


@cache
def tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text())


def module(file: Path) -> str:
    parts = file.relative_to(SRC).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def place(name: str) -> Path | None:
    """The file of a module; None where the name is none of ours."""
    path = SRC.joinpath(*name.split("."))
    return next((each for each in (path / "__init__.py", path.with_suffix(".py")) if each.is_file()), None)


def for_types_alone(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


def statements(node: ast.AST, types: bool) -> Iterator[ast.AST]:
    for child in ast.iter_child_nodes(node):
        if types or not for_types_alone(child):
            yield child
            yield from statements(child, types)


def imported(file: Path, types: bool = True) -> set[str]:
    """Our modules that a file imports, by their full names, without ``types`` but those that run."""
    found: set[str] = set()
    for node in statements(tree(file), types):
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names if each.name.startswith("dreamdrive")}
        elif isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("dreamdrive"):
            assert node.level == 0, f"{file}: imports are absolute"
            for each in node.names:
                inner = f"{node.module}.{each.name}"
                found.add(inner if place(inner) and each.name not in named(node.module) else node.module)
    return found


@cache
def named(package: str) -> set[str]:
    """What the ``__init__`` of a package names by an import or a definition."""
    file = place(package)
    assert file is not None, f"{package} is imported and is not there"
    found: set[str] = set()
    for node in tree(file).body if file.name == "__init__.py" else []:
        if isinstance(node, ast.ImportFrom):
            found |= {each.asname or each.name for each in node.names}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
    return found


def packages(name: str) -> list[str]:
    """The packages that a module is in, the innermost first; a package is in itself."""
    parts = name.split(".")
    names = [".".join(parts[:count]) for count in range(len(parts), 0, -1)]
    return [each for each in names if (SRC.joinpath(*each.split(".")) / "__init__.py").is_file()]


def test_ten_files_at_most_lie_loose() -> None:
    loose = [file.name for file in HOUSE.iterdir() if file.suffix in (".py", ".pyi")]
    assert len(loose) <= MOST_LOOSE, loose


def test_a_file_is_short() -> None:
    lines = {str(file.relative_to(SRC)): len(file.read_text().splitlines()) for file in FILES}
    assert {file: count for file, count in lines.items() if count > MOST_LINES} == {}


def test_a_function_is_short() -> None:
    """Counted without signature and docstring."""
    long = {}
    for file in FILES:
        for node in ast.walk(tree(file)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                body = node.body[1:] if ast.get_docstring(node) is not None else node.body
                count = body[-1].end_lineno - body[0].lineno + 1 if body else 0
                if count > MOST_OF_A_FUNCTION:
                    long[f"{module(file)}.{node.name}"] = count
    assert long == {}


def test_a_package_is_imported_through_what_it_names() -> None:
    wrong = []
    for file in FILES:
        name = module(file)
        for target in sorted(imported(file)):
            where = place(target)
            if where is None or where.name == "__init__.py" or len(packages(target)) == 1:
                continue  # a package itself, or a loose file
            home = packages(target)[0]
            if (
                home not in packages(name)
                and target.split(".")[1] not in OPEN
                and target not in WITH_AN_EXTRA
            ):
                wrong.append(f"{name} imports {target}, inside {home}")
    assert wrong == []


def test_only_their_table_imports_backends() -> None:
    """It names them in strings."""
    wrong = []
    for file in FILES:
        name = module(file)
        for target in imported(file):
            backend = ".".join(target.split(".")[:4])
            shared = any(f"{target}.".startswith(f"{each}.") for each in SHARED)
            if target.startswith(f"{BACKENDS}.") and not shared and not f"{name}.".startswith(f"{backend}."):
                wrong.append(f"{name} imports {target}")
    assert wrong == []


def graph(inside: str) -> dict[str, set[str]]:
    """Which sub-packages and modules of a package import which others of it, commands left out."""
    depth = len(inside.split("."))
    found: dict[str, set[str]] = defaultdict(set)
    for file in FILES:
        name = module(file).split(".")
        if ".".join(name[:depth]) != inside or len(name) == depth:
            continue
        for target in imported(file, types=False):
            parts = target.split(".")
            if ".".join(parts[:depth]) == inside and len(parts) > depth:
                found[name[depth]] |= {parts[depth]} - {name[depth]}
    return found


def circle(edges: dict[str, set[str]]) -> list[str]:
    """Names that import one another in a circle; none where there is no circle."""
    left = {name: set(targets) for name, targets in edges.items()}
    while True:
        free = [name for name in left if not left[name] & set(left)]
        if not free:
            return sorted(left)
        for name in free:
            del left[name]


@pytest.mark.parametrize("inside", ["dreamdrive", "dreamdrive.geometry"])
def test_packages_do_not_import_in_a_circle(inside: str) -> None:
    assert circle(graph(inside)) == []
