"""Sizes of pictures on the command line."""

import re

from dreamdrive.errors import InputError


def parse_size(text: str) -> tuple[int, int]:
    """Width and height from ``480x270``."""
    match = re.fullmatch(r"(\d{1,9})[xX](\d{1,9})", text.strip())
    if match is None:
        raise InputError(f"--size {text}: expected WIDTHxHEIGHT in pixels, such as 480x270")
    from dreamdrive.data.size import check_largest

    size = int(match[1]), int(match[2])
    check_largest(size, f"--size {text}")
    return size
