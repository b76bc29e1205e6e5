"""Old names of modules that moved."""

import importlib
import sys

import pytest

from dreamdrive.registry import MOVED


@pytest.mark.parametrize("old", [*MOVED, "dreamdrive.environment.path"])
def test_an_old_name_is_the_same_module_and_warns(old: str, monkeypatch: pytest.MonkeyPatch) -> None:
    head = next(each for each in MOVED if f"{old}.".startswith(f"{each}."))
    now = importlib.import_module(MOVED[head] + old.removeprefix(head))
    for name in (head, old):
        monkeypatch.delitem(sys.modules, name, raising=False)
    spec = now.__spec__
    with pytest.warns(DeprecationWarning, match=r"is [a-z_.]+ now; the old name goes with 0\.2"):
        assert importlib.import_module(old) is now
    assert now.__spec__ is spec
    for name in (head, old):
        monkeypatch.delitem(sys.modules, name, raising=False)


def test_what_never_was_is_not_found() -> None:
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("dreamdrive.planner")
