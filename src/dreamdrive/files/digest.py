"""Digests of values and files: what two runs have in common."""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import torch

from dreamdrive.files.paths import open_file


def digest(value: object) -> str:
    """SHA-256 of JSON values, arrays, paths, which count by their content, and dataclasses of them."""
    text = json.dumps(value, sort_keys=True, default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: object) -> object:
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: getattr(value, field.name) for field in fields(value)}
    if isinstance(value, Path):
        return file_digest(value, deep=True)
    if isinstance(value, torch.Tensor):
        value = value.detach().cpu().numpy()
    if isinstance(value, np.ndarray):
        whole = np.ascontiguousarray(value)
        return [str(whole.dtype), list(whole.shape), hashlib.sha256(whole.data).hexdigest()]
    if isinstance(value, torch.nn.Module):
        return dict(value.state_dict())
    raise TypeError(f"a stage's options hold a {type(value).__name__}")


def file_digest(path: Path, *, deep: bool = False) -> str:
    """SHA-256 of a file's content, or of names and contents of the files in a folder.

    Hidden files in it do not count, the folders in it if ``deep``. Links are followed.
    """
    if not path.is_dir():
        with open_file(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    files = sorted(file for file in _files(path, deep) if not file.name.startswith("."))
    return digest([[f.relative_to(path).as_posix(), file_digest(f)] for f in files])


def _files(folder: Path, deep: bool, within: frozenset[Path] = frozenset()) -> Iterator[Path]:
    """Files of a folder, those behind links too; ``within`` are the folders that lead there.

    ``Path.rglob`` does not enter folders that are links, which is how weights of several places are joined.
    """
    real = folder.resolve()
    if real in within:
        return
    for entry in folder.iterdir():
        if entry.is_file():
            yield entry
        elif deep and entry.is_dir():
            yield from _files(entry, deep, within | {real})


def stage_seed(seed: int, name: str) -> int:
    """A stage's own seed: results do not depend on which other stages ran before it."""
    return int(digest([seed, name])[:8], 16) % 2**31
