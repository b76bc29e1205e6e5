"""Pickles of pandas' tables without pandas: stand-ins with its names, as two of its versions lay them out."""

import gzip
import pickle
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import numpy as np

_NUMPY = b"numpy._core.multiarray"


class DataFrame:
    def __init__(self, manager: Any, key: str) -> None:
        self.manager, self.key = manager, key

    def __getstate__(self) -> dict[str, Any]:
        return {self.key: self.manager, "_typ": "dataframe", "_metadata": [], "attrs": {}}


class BlockManager:
    """As pandas before 1.3 pickles it: axes, and blocks in a state."""

    def __init__(self, axes: list[Any], blocks: list[tuple[np.ndarray, Any]]) -> None:
        self.axes, self.blocks = axes, blocks

    def __getstate__(self) -> tuple[Any, ...]:
        blocks = [{"values": values, "mgr_locs": places} for values, places in self.blocks]
        return (
            self.axes,
            [values for values, _ in self.blocks],
            [],
            {"0.14.1": {"axes": self.axes, "blocks": blocks}},
        )


class NewBlockManager:
    """As pandas from 1.3 on pickles it: made of blocks and axes."""

    def __init__(self, blocks: tuple["Block", ...], axes: list[Any]) -> None:
        self.blocks, self.axes = blocks, axes

    def __reduce__(self) -> tuple[Any, ...]:
        return NewBlockManager, (self.blocks, self.axes)


class Block:
    def __init__(self, values: np.ndarray, places: Any) -> None:
        self.values, self.places = values, places

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickle_block, (self.values, self.places, 2)


class Index:
    def __init__(self, names: list[str]) -> None:
        self.names = names

    def __reduce__(self) -> tuple[Any, ...]:
        return _new_Index, (Index, {"data": np.array(self.names, dtype=object), "name": None}), None


class RangeIndex:
    def __init__(self, stop: int) -> None:
        self.stop = stop

    def __reduce__(self) -> tuple[Any, ...]:
        return _new_Index, (RangeIndex, {"name": None, "start": 0, "stop": self.stop, "step": 1}), None


def _new_Index(*_: Any) -> None: ...


def _unpickle_block(*_: Any) -> None: ...


_PLACES = {
    DataFrame: ("pandas.core.frame", "DataFrame"),
    BlockManager: ("pandas.core.internals.managers", "BlockManager"),
    NewBlockManager: ("pandas.core.internals.managers", "BlockManager"),
    Index: ("pandas.core.indexes.base", "Index"),
    RangeIndex: ("pandas.core.indexes.range", "RangeIndex"),
    _new_Index: ("pandas.core.indexes.base", "_new_Index"),
    _unpickle_block: ("pandas._libs.internals", "_unpickle_block"),
}


@contextmanager
def _named_like_pandas(manager: type) -> Iterator[None]:
    """The stand-ins under the names of pandas, as pickle looks them up."""
    kept, modules = [], dict(sys.modules)
    try:
        for each, (module, name) in _PLACES.items():
            if each in (BlockManager, NewBlockManager) and each is not manager:
                continue
            kept.append((each, each.__module__, each.__qualname__))
            each.__module__, each.__qualname__ = module, name
            for parent in ("pandas", "pandas.core", "pandas.core.internals", module):
                sys.modules.setdefault(parent, ModuleType(parent))
            setattr(sys.modules[module], name, each)
        yield
    finally:
        for each, module, name in kept:
            each.__module__, each.__qualname__ = module, name
        for module in set(sys.modules) - set(modules):
            del sys.modules[module]


def table_bytes(columns: Mapping[str, Any], new: bool = False, order: Literal["C", "F"] = "C") -> bytes:
    """A table as pandas 1.0 and numpy 1 pickle it for PandaSet, or as pandas 2 and numpy 2 do."""
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    arrays = {name: a.astype(object) if a.dtype.kind in "UO" else a for name, a in arrays.items()}
    names = list(arrays)
    blocks: list[tuple[np.ndarray, Any]] = []
    for kind in dict.fromkeys(a.dtype for a in arrays.values()):
        places = [k for k, name in enumerate(names) if arrays[name].dtype == kind]
        step = places[1] - places[0] if len(places) > 1 else 1
        regular = all(b - a == step for a, b in pairwise(places))
        where = slice(places[0], places[-1] + 1, step) if regular else np.array(places)
        blocks.append((np.array([arrays[names[k]] for k in places], dtype=kind, order=order), where))
    count = len(next(iter(arrays.values()))) if arrays else 0
    axes = [Index(names), RangeIndex(count)]
    if new:
        made = NewBlockManager(tuple(Block(*each) for each in blocks), axes)
        with _named_like_pandas(NewBlockManager):
            return pickle.dumps(DataFrame(made, "_mgr"), protocol=5)
    with _named_like_pandas(BlockManager):
        data = pickle.dumps(DataFrame(BlockManager(axes, blocks), "_data"), protocol=3)
    return data.replace(b"c" + _NUMPY, b"cnumpy.core.multiarray")


def write_table(path: Path, columns: Mapping[str, Any], new: bool = False) -> None:
    """A table, packed where the name of the file says so."""
    data = table_bytes(columns, new)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else data)
