"""How names are found: what packages offer, at first use; what can be chosen by name; modules that moved."""

import ast
import sys
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar, cast

from dreamdrive.errors import InputError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints


T = TypeVar("T")
MOVED = {
    "dreamdrive.data.argoverse": "dreamdrive.datasets.argoverse",
    "dreamdrive.data.kitti": "dreamdrive.datasets.kitti",
    "dreamdrive.data.logs": "dreamdrive.datasets.logs",
    "dreamdrive.data.nuscenes": "dreamdrive.datasets.nuscenes",
    "dreamdrive.data.pandaset": "dreamdrive.datasets.pandaset",
    "dreamdrive.device": "dreamdrive.compute.device",
    "dreamdrive.environment": "dreamdrive.tasks.environment",
    "dreamdrive.knowledge.training": "dreamdrive_train.street_network",
    "dreamdrive.knowledge": "dreamdrive.street_network",
    "dreamdrive.machine": "dreamdrive.compute.machine",
    "dreamdrive.perception": "dreamdrive.tasks.perception",
    "dreamdrive.plan": "dreamdrive.tasks.plan",
    "dreamdrive.scene.action": "dreamdrive.scene.control.action",
    "dreamdrive.scene.layout": "dreamdrive.scene.street.layout",
    "dreamdrive.scene.log": "dreamdrive.scene.street.log",
    "dreamdrive.scene.look": "dreamdrive.scene.street.look",
    "dreamdrive.world": "streetworld",
}
GOES_WITH = "0.2"
"""The version without these names: the minor version after the one that moved them."""
FRAMES = "dreamdrive.show.rendering:frames"
"""What ``Scene.render`` is."""
SHOWN = {
    "Look": "dreamdrive.show.notebook:of_look",
    "Scene": "dreamdrive.show.notebook:of_scene",
    "Trajectory": "dreamdrive.show.notebook:of_trajectory",
}
"""What nouns look like in notebooks, by their classes: they lie below all that draws."""


class _Offering(ModuleType):
    """A package that loads what it offers at first use."""

    _homes: dict[str, tuple[str, str]]

    def __getattr__(self, name: str) -> object:
        if name not in self._homes:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        module, inside = self._homes[name]
        own = module == self.__name__
        value = import_module(f"{module}.{inside}") if own else getattr(import_module(module), inside)
        self.__dict__[name] = value
        return value

    def __setattr__(self, name: str, value: object) -> None:
        # A module below that is called like something on offer does not hide it once it is loaded.
        if not isinstance(value, ModuleType) or self._homes.get(name, ("", ""))[0] in ("", self.__name__):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted(self._homes)


def offer(package: str) -> tuple[str, ...]:
    """Make a package offer, for its ``__all__``, what its ``__init__`` imports ``if TYPE_CHECKING``.

    Nothing of that is loaded before it is used, so that who needs one name pays for that alone.
    """
    module = sys.modules[package]
    assert module.__file__ is not None
    homes = dict(_imported(ast.parse(Path(module.__file__).read_text("utf-8"))))
    module.__dict__["_homes"] = homes
    module.__class__ = _Offering
    return tuple(homes)


def _imported(tree: ast.Module) -> Iterator[tuple[str, tuple[str, str]]]:
    for block in tree.body:
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING":
            for node in block.body:
                if isinstance(node, ast.ImportFrom) and node.module is not None:
                    yield from ((each.asname or each.name, (node.module, each.name)) for each in node.names)


@dataclass(frozen=True, eq=False)
class Table(Mapping[str, T]):
    """Entries of dreamdrive's own and of outside packages by their names; each is loaded when it is taken.

    Attributes:
        option: The option that takes the names, for messages.
        group: Entry points of this group are entries, too.
        kind: What every entry is, as ``module:name``; it has an attribute ``name``.
        own: The own entries as ``module:name``, by their names.
    """

    option: str
    group: str
    kind: str
    own: Mapping[str, str]

    def __iter__(self) -> Iterator[str]:
        yield from dict.fromkeys([*self.own, *sorted(each.name for each in self._outside())])

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __contains__(self, name: object) -> bool:
        return name in list(self)

    def __getitem__(self, name: str) -> T:
        """The entry of that name.

        Raises:
            KeyError: There is none.
            InputError: The package that it is from cannot be loaded, or two packages have one of that name.
        """
        entry = self._entry(name)
        return cast(T, loaded(self.own[name]) if entry is None else self._loaded(entry))

    def choose(self, name: str) -> T:
        """The entry of a name that a user gave.

        Raises:
            InputError: There is none, or see ``__getitem__``.
        """
        if name not in self:
            import difflib  # here: most commands make no mistake

            near = difflib.get_close_matches(name, self, n=1)
            meant = f"; did you mean {near[0]}?" if near else ""
            raise InputError(f"{self.option} {name}: unknown; available are {', '.join(self)}{meant}")
        return self[name]

    def package(self, name: str | None) -> dict[str, str]:
        """Version of the outside package that an entry is from, by its name; empty for an own one."""
        entry = None if name is None else self._entry(name)
        dist = None if entry is None else entry.dist
        return {} if dist is None else {dist.name: dist.version}

    def _outside(self) -> "list[EntryPoint]":
        return list(_entry_points(self.group, tuple(sys.path)))

    def _entry(self, name: str) -> "EntryPoint | None":
        """The outside entry of that name; None for an own one."""
        found = [each for each in self._outside() if each.name == name]
        if name in self.own:
            if found:
                _warn(f"{self.option} {name} is dreamdrive's own; that of {_package(found[0])} is not used")
            return None
        if not found:
            raise KeyError(name)
        if len(found) > 1:
            packages = " and ".join(sorted(map(_package, found)))
            raise InputError(f"{self.option} {name}: {packages} both have one; uninstall one of them")
        return found[0]

    def _loaded(self, entry: "EntryPoint") -> object:
        where = f"{self.option} {entry.name}: the package {_package(entry)}"
        try:
            made = entry.load()
        except Exception as error:
            raise InputError(f"{where} cannot be loaded ({type(error).__name__}: {error})") from error
        kind = cast("type[object]", loaded(self.kind))
        if not isinstance(made, kind) or getattr(made, "name", None) != entry.name:
            raise InputError(f"{where} gives no {kind.__name__} called {entry.name}, but {made!r}")
        return made


@lru_cache(maxsize=8)
def _entry_points(group: str, path: tuple[str, ...]) -> "EntryPoints":
    """Those that packages on the path have: it takes 20 ms to look, and a command asks some eighty times."""
    from importlib.metadata import entry_points

    return entry_points(group=group)


def loaded(place: str) -> Any:
    """What ``module:name`` stands for."""
    from importlib.metadata import EntryPoint

    return EntryPoint("", place, "").load()


def shown(noun: object) -> str:
    """A noun as notebooks show it: HTML."""
    return loaded(SHOWN[type(noun).__name__])(noun)


def _package(entry: "EntryPoint") -> str:
    return entry.value if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"


@cache
def _warn(text: str) -> None:
    """Warn once."""
    import logging

    logging.getLogger("dreamdrive").warning(text)


class MovedFinder(MetaPathFinder, Loader):
    """Finds a module that moved, and those below it, by their old names: they are the same modules."""

    def find_spec(self, fullname: str, path: object, target: ModuleType | None = None) -> ModuleSpec | None:
        """Of an old name alone."""
        return None if _now(fullname) is None else ModuleSpec(fullname, self)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """The module by its new name."""
        now = _now(spec.name)
        assert now is not None
        warnings.warn(
            f"{spec.name} is {now} now; the old name goes with {GOES_WITH}", DeprecationWarning, stacklevel=2
        )
        module = import_module(now)
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """It ran when it was imported; what it is called stays."""
        spec = module.__spec__
        assert spec is not None
        module.__spec__ = spec.loader_state


def _now(name: str) -> str | None:
    for old, new in MOVED.items():
        if name == old or name.startswith(f"{old}."):
            return new + name.removeprefix(old)
    return None
