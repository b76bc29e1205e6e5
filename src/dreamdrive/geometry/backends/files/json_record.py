"""JSON objects of geometry files."""

from pathlib import Path
from typing import Any

from dreamdrive.files.json_file import read_json

OPTION = "--geometry-files"


def read_record(path: Path) -> dict[str, Any]:
    """The JSON object in a file.

    Raises:
        InputError: The file is missing or holds something else.
    """
    return read_json(path, OPTION)
