"""Weights by the name they have on a model hub, from the copies that are already on this machine."""

import os
import re
from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.files.paths import is_inside, read_text

_NAME = re.compile(r"[A-Za-z0-9][\w.-]*/[\w.-]+")


def find_weights(given: str | Path) -> Path:
    """The file or folder that ``--weights`` means; nothing is ever downloaded.

    Args:
        given: A path, or ``owner/name`` of a model whose snapshot lies in the hub's cache (``HF_HUB_CACHE``,
            ``HF_HOME/hub`` or ``~/.cache/huggingface/hub``). What exists as a path is taken as one.

    Raises:
        InputError: Neither a path nor a cached model.
    """
    path = Path(given)
    if path.exists():
        return path
    name = str(given)
    if not _NAME.fullmatch(name) or path.suffix in (".pth", ".pt", ".safetensors"):
        raise InputError(f"--weights {name} does not exist; expected a file of weights or its folder")
    folder = cache() / f"models--{name.replace('/', '--')}"
    current = folder / "refs" / "main"
    commit = read_text(current, at_most=1000).strip() if current.is_file() else "none"
    snapshot = folder / "snapshots" / commit
    if not is_inside(commit) or not snapshot.is_dir():
        raise InputError(
            f"--weights {name} is neither a path nor a model in {cache()}; "
            f"to download it yourself: hf download {name}"
        )
    return snapshot


def cache() -> Path:
    """Where models of the hub are kept on this machine."""
    if given := os.environ.get("HF_HUB_CACHE"):
        return Path(given).expanduser()
    home = os.environ.get("HF_HOME", Path("~/.cache/huggingface"))
    return Path(home).expanduser() / "hub"
