"""Which stages a change of the program touches."""

import ast
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from dreamdrive.data.table import DATASETS
from dreamdrive.geometry import BACKENDS
from dreamdrive.prior import PRIORS
from dreamdrive.run import program
from dreamdrive.run.program import PACKAGE, program_of
from dreamdrive.run.stages import STAGES

ALL = set(STAGES)
TOUCHED: dict[str, set[str]] = {
    "show/panels.py": set(),
    "run/report/judge.py": set(),
    "cli/generate.py": set(),
    "export/ply.py": set(),
    "prior/replay.py": {"prior"},
    "street_network/street.safetensors": {"prior", "look"},
    "geometry/surround.py": {"geometry"},
    "fit/hybrid.py": {"fit"},
    "fit/trainer.py": {"geometry", "static", "fit"},
    "decompose/group.py": {"geometry", "group", "fit"},
    "stored/folder.py": {"fit"},
    "scene/gaussians.py": ALL,
    "build.py": ALL,
}


@pytest.fixture(scope="module")
def touched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str], set[str]]]:
    """Of a copy of the package: the stages that are another program after a change of one file."""
    copy = tmp_path_factory.mktemp("src") / "dreamdrive"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__", "photo.safetensors"))
    before = {stage: program_of(stage, copy) for stage in STAGES}

    def change(name: str) -> set[str]:
        file = copy / name
        was = file.read_bytes()
        file.write_bytes(was + b"\n")
        program_of.cache_clear()
        program._sha256.cache_clear()
        found = {stage for stage in STAGES if program_of(stage, copy) != before[stage]}
        file.write_bytes(was)
        return found

    yield change
    program_of.cache_clear()


@pytest.mark.parametrize("name", TOUCHED)
def test_a_change_touches_the_stages_that_import_it(touched: Callable[[str], set[str]], name: str) -> None:
    assert touched(name) == TOUCHED[name]


def test_the_compiled_core_counts_where_it_computes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    before = {stage: program_of(stage) for stage in STAGES}
    other = tmp_path / "_native.so"
    other.write_bytes(b"another core")
    monkeypatch.setattr(program._native, "__file__", str(other))
    program_of.cache_clear()
    changed = {stage for stage in STAGES if program_of(stage) != before[stage]}
    program_of.cache_clear()
    assert {"geometry", "static", "score", "fit"} <= changed
    assert not {"look", "initialise", "group"} & changed


@pytest.mark.parametrize(("table", "stage"), [(PRIORS, "prior"), (DATASETS, "prior"), (BACKENDS, "geometry")])
def test_what_tables_name_in_strings_is_part_of_its_stage(table, stage: str) -> None:
    reached = program._reached(program._inside(program._OWN[stage], PACKAGE), PACKAGE)
    assert {place.partition(":")[0] for place in table.own.values()} <= reached


def test_the_drawn_street_is_part_of_the_prior_alone() -> None:
    """It lies in a product of its own."""
    for stage, within in (("prior", True), ("look", False), ("geometry", False), ("fit", False)):
        reached = program._reached(program._inside(program._OWN[stage], PACKAGE), PACKAGE)
        assert ("streetworld.edition1.traffic" in reached) is within
        assert bool(program._files("streetworld.edition1.traffic", PACKAGE))


def test_no_package_acts_when_it_is_imported() -> None:
    """Or the names that it passes on would not tell all that it does."""
    harmless = ast.Import | ast.ImportFrom | ast.Assign | ast.AnnAssign | ast.FunctionDef | ast.ClassDef
    acting = []
    for file in PACKAGE.rglob("__init__.py"):
        body = [each for each in ast.parse(file.read_text()).body[1:] if not _idle(each)]
        if not all(isinstance(each, harmless) for each in body):
            acting.append(file.parent.name)
    # The first finds modules by their old names, which nothing here uses; no stage imports the other.
    assert sorted(acting) == ["dreamdrive", "environment"]


def _idle(node: ast.AST) -> bool:
    """For type checkers, or a sentence below a name."""
    if isinstance(node, ast.If):
        return ast.unparse(node.test) == "TYPE_CHECKING"
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def test_each_stage_is_made_of_what_the_pipeline_calls_for_it() -> None:
    """What ``run`` computes, by the names in it, is reached by its stage or one before."""
    tree = ast.parse((PACKAGE / "build.py").read_text())
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    homes = {
        each.name: program._home(node.module, each.name, PACKAGE)
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("dreamdrive")
        for each in node.names
    }

    def is_stage(node: ast.AST) -> bool:
        return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "run"

    def used(node: ast.AST, local: dict[str, ast.AST], seen: set[str]) -> set[str]:
        names = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)} - seen
        seen |= names
        found = {homes[name] for name in names if name in homes}
        for name in names & (functions.keys() | local.keys()):
            found |= used(functions.get(name) or local[name], local, seen)
        return found

    reached: set[str] = set(program._AROUND)
    stages = []
    for function in (functions[name] for name in ("build_scene", "_scores", "decompose", "build_scene")):
        local = {
            node.targets[0].id: node.value
            for node in ast.walk(function)
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
            if not any(is_stage(each) for each in ast.walk(node.value))
        }
        calls = [node for node in ast.walk(function) if is_stage(node)]
        for call in sorted(calls, key=lambda node: node.lineno):
            name = call.args[0].value
            if (name == "fit") is ("group" not in stages):
                continue  # the stages of ``decompose`` come in between
            stages.append(name)
            reached |= program._reached(program._inside(program._OWN[name], PACKAGE), PACKAGE)
            passed = {"dreamdrive.names", "dreamdrive.stored.check", "dreamdrive.run.report.document"}
            assert used(call, local, set()) - reached - passed == set(), name
    assert set(stages) == ALL - {"prior"}
