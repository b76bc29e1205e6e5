"""The same as ``python -m dreamdrive_bench pinned``."""

from dreamdrive_bench.commands import script

script("pinned", __name__)
