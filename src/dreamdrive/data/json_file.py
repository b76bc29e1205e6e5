"""JSON objects from files."""

import json
from pathlib import Path
from typing import Any, cast

from dreamdrive.errors import InputError


def read_json(path: Path, option: str) -> dict[str, Any]:
    """The JSON object in a file.

    Raises:
        InputError: The file is missing or holds something else.
    """
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{option} {path} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InputError(f"{option} {path} is not JSON: {error}") from error
    if not isinstance(values, dict):
        raise InputError(f"{option} {path}: expected a JSON object, got a {type(values).__name__}")
    return cast("dict[str, Any]", values)
