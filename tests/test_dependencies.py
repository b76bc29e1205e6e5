"""What is imported is named among the dependencies, or in an extra."""

import ast
import re
import sys
import tomllib
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

from tests.conftest import ROOT

PRODUCTS = {
    "src": ".",
    "benchmarks": "benchmarks",
    "examples": ".",
    "packages/streetworld/src": "packages/streetworld",
    "packages/dreamdrive_train/src": "packages/dreamdrive_train",
}
"""Where the ``pyproject.toml`` lies that names what a folder imports."""
NAMES = {
    "PIL": "pillow",
    "cv2": "opencv-python-headless",
    "foxglove": "foxglove-sdk",
    "ncore": "nvidia-ncore",
    "pxr": "usd-core",
    "skimage": "scikit-image",
    "sklearn": "scikit-learn",
    "upath": "universal-pathlib",
}
"""Packages whose modules have another name."""
APART = {
    "_typeshed": "of type checkers alone",
    "fused_ssim": "compared with where it is there; in no index",
    "nuscenes": "runs in an environment of its own, see the benchmark devkit",
}


@cache
def statements(file: Path) -> list[ast.AST]:
    return list(ast.walk(ast.parse(file.read_text())))


def plain(name: str) -> str:
    """A package's name, without versions, as indices compare them."""
    return re.sub(r"[-_.]+", "-", re.split(r"[\[<>=!~; ]", name, maxsplit=1)[0]).lower()


def imported(folder: str) -> dict[str, set[Path]]:
    """Outer modules that are imported below a folder, at the top of a file or inside, with the files."""
    found: dict[str, set[Path]] = defaultdict(set)
    own = {"dreamdrive", "dreamdrive_bench", "dreamdrive_train", "streetworld", "tests"}
    own |= {each.stem for each in (ROOT / folder).iterdir()}
    for file in (ROOT / folder).rglob("*.py"):
        for node in statements(file):
            names = [each.name for each in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                names = [node.module]
            for name in {name.split(".")[0] for name in names} - own - set(sys.stdlib_module_names):
                found[name].add(file)
    return found


def weights() -> set[str]:
    """Packages of which only a file of weights is used, which no import names."""
    found: set[str] = set()
    for file in (ROOT / "src").rglob("*.py"):
        for node in statements(file):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "PackagedFile":
                found.add(ast.literal_eval(node.args[0]))
    return found


def named(product: str) -> set[str]:
    """What a product depends on, or has an extra for."""
    project = tomllib.loads((ROOT / product / "pyproject.toml").read_text())["project"]
    extras = project.get("optional-dependencies", {}).items()
    listed = [*project["dependencies"], *(one for name, each in extras if name != "dev" for one in each)]
    return {plain(each) for each in listed}


@pytest.mark.parametrize("folder", PRODUCTS)
def test_what_is_imported_is_a_dependency_or_in_an_extra(folder: str) -> None:
    found, known = imported(folder), named(PRODUCTS[folder])
    assert "numpy" in found
    missing = {
        name: sorted(map(str, files))
        for name, files in found.items()
        if plain(NAMES.get(name, name)) not in known and name not in APART
    }
    assert missing == {}


def test_packages_of_weights_are_in_an_extra() -> None:
    packaged = weights()
    assert len(packaged) == 3
    assert {name for name in packaged if plain(name) not in named(".")} == set()
