"""Results on disk with the digest of what they follow from; one of another digest counts as missing."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from dreamdrive.files.output import new_file

Features = dict[str, Float[np.ndarray, "n d"]]
"""Of each network and view, by ``NETWORK/VIEW``."""


def kept(path: Path, key: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """The record in a file if it is of this key, else a new one, which is kept there."""
    if not is_current(path, key):
        save(path, key, make())
    return {name: value for name, value in json.loads(path.read_text()).items() if name != "key"}


def save(path: Path, key: str, record: dict[str, Any], features: Features | None = None) -> None:
    """The record as JSON and features beside it; the JSON last, as it says that all is there."""
    if features is not None:
        with new_file(path.with_suffix(".npz")) as partial:
            np.savez_compressed(partial, **features)
    with new_file(path) as partial:
        partial.write_text(json.dumps({"key": key, **record}, indent=1) + "\n")


def load(path: Path) -> dict[str, Any] | None:
    """The record; None where there is none, or its file is cut short."""
    try:
        return json.loads(path.read_text())
    except (FileNotFoundError, ValueError):
        return None


def is_current(path: Path, key: str) -> bool:
    """Whether there is a record of this key."""
    found = load(path)
    return found is not None and found.get("key") == key


def load_features(path: Path) -> Features:
    """The features beside a record."""
    with np.load(path.with_suffix(".npz")) as stored:
        return {name: stored[name] for name in stored.files}
