"""The rules of the folders, held over the syntax trees of all products."""

import ast
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.conftest import ROOT

SRC = ROOT / "src"
ROOTS = {
    "dreamdrive": SRC,
    "streetworld": ROOT / "packages" / "streetworld" / "src",
    "dreamdrive_train": ROOT / "packages" / "dreamdrive_train" / "src",
}
"""The products, and where each lies."""
HOUSE = SRC / "dreamdrive"
FILES = sorted(HOUSE.rglob("*.py"))
ALL = [file for name, root in ROOTS.items() for file in sorted((root / name).rglob("*.py"))]
OPEN = {"scene", "files", "data", "datasets", "vision", "metrics", "compute"}
"""Packages whose modules others import one by one."""
BACKENDS = "dreamdrive.geometry.backends"
ABOVE = {"tasks", "evaluate", "export", "view"}
ENTRY = "dreamdrive.cli.main"
"""What the command and ``python -m dreamdrive`` start with."""
WITH_AN_EXTRA = {"dreamdrive.prior.vista.convert", "dreamdrive.prior.vista.features"}
"""They need packages that are not always there, so that no ``__init__`` can name them."""
SHARED = {"dreamdrive.geometry.backends.files", "dreamdrive.geometry.backends.dust3r.align"}
"""No backends: what the user gives, which all take, and the geometry of pointmaps, which two share."""
TABLES = {
    "dreamdrive.data.table",
    "dreamdrive.export.kinds",
    "dreamdrive.export.table",
    "dreamdrive.geometry.table",
    "dreamdrive.registry",
    "dreamdrive.prior.table",
    "dreamdrive.run.program",
}
"""They name modules in strings, of which a run loads the one that was chosen."""
MOST_LOOSE, MOST_LINES, MOST_OF_A_FUNCTION, MOST_IN_A_FOLDER, MOST_OF_A_COMMAND = 10, 400, 50, 15, 12
MOST_REACHED = {"dreamdrive.build": 20_000, "dreamdrive.show": 10_000}
"""Lines of Python that are loaded with a module, or with all that a package offers."""


@cache
def tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text())


@pytest.fixture(scope="module", autouse=True)
def trees() -> None:
    """All files are parsed once, for all rules."""
    for file in ALL:
        tree(file)


def module(file: Path) -> str:
    root = next(root for root in ROOTS.values() if file.is_relative_to(root))
    parts = file.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def place(name: str) -> Path | None:
    """The file of a module; None where the name is none of ours."""
    root = ROOTS.get(name.partition(".")[0])
    if root is None:
        return None
    path = root.joinpath(*name.split("."))
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
            found |= {each.name for each in node.names if each.name.partition(".")[0] in ROOTS}
        elif isinstance(node, ast.ImportFrom) and node.module and node.module.partition(".")[0] in ROOTS:
            assert node.level == 0, f"{file}: imports are absolute"
            for each in node.names:
                inner = f"{node.module}.{each.name}"
                found.add(inner if place(inner) and each.name not in offered(node.module) else node.module)
    return found


@cache
def offered(package: str) -> dict[str, tuple[str, str]]:
    """What the ``__init__`` of a package offers, by its names: the module and the name there."""
    file = place(package)
    assert file is not None, f"{package} is imported and is not there"
    found: dict[str, tuple[str, str]] = {}
    for node in statements(tree(file), types=True) if file.name == "__init__.py" else ():
        if isinstance(node, ast.ImportFrom) and node.module and node.module.partition(".")[0] in ROOTS:
            found |= {each.asname or each.name: (node.module, each.name) for each in node.names}
    return found


@cache
def home(module: str, name: str) -> str:
    """The module that a name of a module is defined in, behind all packages that offer it."""
    if place(f"{module}.{name}") and offered(module).get(name, (module, name)) == (module, name):
        return f"{module}.{name}"
    if name in offered(module) and offered(module)[name] != (module, name):
        return home(*offered(module)[name])
    return module


@cache
def loaded_with(name: str) -> frozenset[str]:
    """Modules that are loaded with one, those in strings as well, unless it is a table of choices."""
    file = place(name)
    assert file is not None
    found: set[str] = set()
    if file.name == "__init__.py" and "offer(__name__)" in file.read_text():
        return frozenset()
    for node in statements(tree(file), types=True):
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names if place(each.name)}
        elif isinstance(node, ast.ImportFrom) and node.module and place(node.module):
            found |= {home(node.module, each.name) for each in node.names}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and name not in TABLES:
            named = node.value.partition(":")[0]
            found |= {named} if "." in named and " " not in named and place(named) else set()
    return frozenset(found - {name})


def reached(start: set[str]) -> set[str]:
    """All modules that are loaded in the end."""
    found, todo = set[str](), list(start)
    while todo:
        name = todo.pop()
        if name not in found:
            found.add(name)
            todo += loaded_with(name)
    return found


def packages(name: str) -> list[str]:
    """The packages that a module is in, the innermost first; a package is in itself."""
    parts = name.split(".")
    names = [".".join(parts[:count]) for count in range(len(parts), 0, -1)]
    return [each for each in names if (file := place(each)) is not None and file.name == "__init__.py"]


def test_ten_files_at_most_lie_loose() -> None:
    loose = [file.name for file in HOUSE.iterdir() if file.suffix in (".py", ".pyi")]
    assert len(loose) <= MOST_LOOSE, loose


def test_a_file_is_short() -> None:
    lines = {str(file.relative_to(ROOT)): len(file.read_text().splitlines()) for file in ALL}
    assert {file: count for file, count in lines.items() if count > MOST_LINES} == {}


def test_a_function_is_short() -> None:
    """Counted without signature and docstring."""
    long = {}
    for file in ALL:
        for node in ast.walk(tree(file)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                body = node.body[1:] if ast.get_docstring(node) is not None else node.body
                count = body[-1].end_lineno - body[0].lineno + 1 if body else 0
                if count > MOST_OF_A_FUNCTION:
                    long[f"{module(file)}.{node.name}"] = count
    assert long == {}


def test_a_folder_has_fifteen_modules_at_most() -> None:
    found = Counter(str(file.parent.relative_to(ROOT)) for file in ALL if file.name != "__init__.py")
    assert {folder: count for folder, count in found.items() if count > MOST_IN_A_FOLDER} == {}


def test_a_command_takes_twelve_parameters_at_most() -> None:
    found = {
        f"{module(file)}.{node.name}": len(node.args.args) + len(node.args.kwonlyargs)
        for file in ALL
        if ".cli" in module(file)
        for node in tree(file).body
        if isinstance(node, ast.FunctionDef)
    }
    assert {name: count for name, count in found.items() if count > MOST_OF_A_COMMAND} == {}


def test_a_public_class_has_a_name_of_its_own() -> None:
    found: dict[str, list[str]] = defaultdict(list)
    for file in ALL:
        for node in tree(file).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(module(file))
    assert {name: places for name, places in found.items() if len(places) > 1} == {}


def test_products_are_named_in_tables_alone() -> None:
    wrong = [
        f"{module(file)} imports {target}"
        for file in FILES
        for target in imported(file)
        if target.partition(".")[0] != "dreamdrive"
    ]
    assert wrong == []


@pytest.mark.parametrize("name", MOST_REACHED)
def test_what_is_loaded_with_the_core_is_small(name: str) -> None:
    start = {name} | {home(name, each) for each in offered(name)} if "build" not in name else {name}
    lines = {each: len(place(each).read_text().splitlines()) for each in reached(start)}
    most = MOST_REACHED[name]
    assert sum(lines.values()) < most, sorted(lines.items(), key=lambda item: -item[1])


def test_files_do_not_import_in_a_circle() -> None:
    """Imports for types alone count, too."""
    assert circle({name: set(loaded_with(name)) for name in map(module, ALL)}) == []


def test_a_package_is_imported_through_what_it_names() -> None:
    """By others; the modules of one package know one another."""
    wrong = []
    for file in FILES:
        name = module(file)
        for target in sorted(imported(file)):
            where = place(target)
            if where is None or where.name == "__init__.py" or len(packages(target)) == 1:
                continue  # a package itself, or a loose file
            if (
                target.split(".")[:2] != name.split(".")[:2]
                and target.split(".")[1] not in OPEN
                and target not in {*WITH_AN_EXTRA, ENTRY}
            ):
                wrong.append(f"{name} imports {target}")
    assert wrong == []


def test_what_scenes_are_used_for_is_imported_by_nobody_below() -> None:
    """Stages, runs and pictures of scenes know neither tasks nor figures nor exports."""
    wrong = []
    for file in FILES:
        name = module(file)
        if not {*name.split(".")[1:2]} & {*ABOVE, "cli"}:
            wrong += [f"{name} imports {each}" for each in imported(file) if {*each.split(".")[1:2]} & ABOVE]
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
