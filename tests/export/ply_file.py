"""PLY files as a 3DGS viewer reads them."""

from pathlib import Path

import numpy as np


def columns(path: Path) -> dict[str, np.ndarray]:
    """The values (N,) of each field, in the order of the file."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    names = [line.split()[-1] for line in header.decode().splitlines() if line.startswith("property")]
    table = np.frombuffer(body, "<f4").reshape(-1, len(names))
    return dict(zip(names, table.T, strict=True))


def count(path: Path) -> int:
    """Number of Gaussians."""
    return len(columns(path)["x"])
