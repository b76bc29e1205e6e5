"""Where the checkout, its data and its program are."""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[4]


def _shared(variable: str, name: str) -> Path:
    return Path(os.environ.get(variable, ROOT / "../shared" / name)).resolve()


DATA = _shared("DREAMDRIVE_DATA", "data")
BENCH = _shared("DREAMDRIVE_BENCH", "bench")
DREAMDRIVE = [sys.executable, "-u", "-c", "from dreamdrive.cli.main import main; main()"]
"""The command line of the code that the benchmark itself runs."""
