"""Which program makes the result of a stage: its sources, and all that these lead to by imports.

Imports are read off the syntax trees, those inside functions too. A name that a package's ``__init__`` only
passes on leads to the module that it comes from; else the ``__init__`` counts as a module. What is in doubt
counts: a stage that is computed again for nothing is better than an old result.
"""

import ast
import hashlib
from collections.abc import Iterator, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from dreamdrive import _native
from dreamdrive.files.digest import digest

PACKAGE = Path(__file__).resolve().parents[1]
_NATIVE = "dreamdrive._native"
_PRODUCTS = "dreamdrive", "streetworld"
"""Whose modules make results."""
_OWN: dict[str, tuple[str, ...]] = {
    "prior": (
        *("dreamdrive.prior", "dreamdrive.data", "dreamdrive.datasets", "streetworld"),
        "dreamdrive.geometry.backends.files",
    ),
    "look": ("dreamdrive.street_network",),
    "geometry": ("dreamdrive.geometry", "dreamdrive.fit.trial", "dreamdrive.decompose.per_frame"),
    "initialise": ("dreamdrive.fit.initialise",),
    "static": ("dreamdrive.fit.static",),
    "score": ("dreamdrive.decompose.errors", "dreamdrive.decompose.score"),
    "group": ("dreamdrive.decompose.group",),
    "fit": (
        *(
            "dreamdrive.complete",
            "dreamdrive.fit",
            "dreamdrive.decompose",
            "dreamdrive.motion",
            "dreamdrive.stored",
        ),
        *("dreamdrive.splat.scene_view", "dreamdrive.vision.residual"),
    ),
}
"""Whose work each stage is; of a package all modules count, since tables name some of them."""
_AROUND = (
    *("dreamdrive.build", "dreamdrive.options", "dreamdrive.progress", "dreamdrive.compute.device"),
    *("dreamdrive.run.stages", "dreamdrive.run.codec", "dreamdrive.files.digest", "dreamdrive.run.program"),
)
"""What runs every stage and keeps its result, without what it imports for others."""


@cache
def program_of(stage: str, package: Path = PACKAGE) -> str:
    """SHA-256 of all that a stage's result depends on: sources, data beside them and the compiled core."""
    names = {*_reached(_inside(_OWN[stage], package), package), *_AROUND}
    return digest([[name, [_sha256(file) for file in _files(name, package)]] for name in sorted(names)])


@cache
def program_digest() -> str:
    """SHA-256 of the package's sources and of its compiled core: another program keeps other results."""
    files = [*PACKAGE.rglob("*.py"), Path(_native.__file__)]
    return digest([[file.name, _sha256(file)] for file in sorted(files)])


def _inside(names: Sequence[str], package: Path) -> set[str]:
    """The modules of these names, with all that are in them."""
    found = set(names)
    for name in names:
        for file in _folder(name, package).rglob("*.py"):
            below = file.relative_to(_folder(name, package)).with_suffix("").parts
            found.add(".".join([name, *(below[:-1] if below[-1] == "__init__" else below)]))
    return found


def _reached(names: set[str], package: Path) -> set[str]:
    """The modules of these names, and all that they import, and what those do."""
    found, new = set[str](), names
    while new:
        found |= new
        new = {target for name in new for target in _imports(name, package)} - found
    return found


@cache
def _imports(name: str, package: Path) -> frozenset[str]:
    """The modules that one imports when it, or what is in it, runs."""
    file, found = _place(name, package), set[str]()
    for node in [] if file is None else _running(_tree(file)):
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            found |= {_home(node.module, each.name, package) for each in node.names}
    return frozenset(each for each in found if "." in each and each.partition(".")[0] in _PRODUCTS)


def _running(node: ast.AST) -> Iterator[ast.AST]:
    """All statements below a node but those for type checkers alone."""
    for name in ("body", "orelse", "handlers", "finalbody", "cases"):
        for child in getattr(node, name, ()):
            if not (isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"):
                yield child
                yield from _running(child)


def _home(module: str, name: str, package: Path) -> str:
    """Where a name comes from that is imported from a module or a package."""
    inner = f"{module}.{name}"
    if inner == _NATIVE or _place(inner, package) is not None:
        return inner
    file = _place(module, package)
    passed = _passed_on(file) if file is not None and file.name == "__init__.py" else {}
    return _home(*passed[name], package) if name in passed else module


@cache
def _passed_on(file: Path) -> dict[str, tuple[str, str]]:
    """The names that an ``__init__`` imports or offers, with where from, and under which name."""
    body = _tree(file).body
    offered = [each for node in body if isinstance(node, ast.If) for each in node.body]
    return {
        each.asname or each.name: (node.module, each.name)
        for node in [*body, *offered]
        if isinstance(node, ast.ImportFrom) and node.module is not None
        for each in node.names
    }


def _files(name: str, package: Path) -> list[Path]:
    """The source of a module, and the data that lie beside it, such as weights."""
    if name == _NATIVE:
        return [Path(_native.__file__)]
    file = _place(name, package)
    if file is None:
        return []
    beside = [each for each in file.parent.iterdir() if each.is_file() and each.suffix not in (".py", ".pyi")]
    return [file, *sorted(beside)]


@cache
def _place(name: str, package: Path) -> Path | None:
    """The source of a module; None where there is none of that name."""
    folder = _folder(name, package)
    places = folder / "__init__.py", folder.with_suffix(".py")
    return next((each for each in places if each.is_file()), None)


def _folder(name: str, package: Path) -> Path:
    """Where a module lies, or a package; a product that is not installed lies nowhere."""
    product, *below = name.split(".")
    if product == package.name:
        return package.joinpath(*below)
    found = find_spec(product)
    places = [] if found is None else found.submodule_search_locations or []
    return next((Path(each) for each in places), package.parent / product).joinpath(*below)


def _tree(file: Path) -> ast.Module:
    return ast.parse(file.read_bytes())


@cache
def _sha256(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()
