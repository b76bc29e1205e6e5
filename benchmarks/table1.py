"""The same as ``python -m dreamdrive_bench table1``."""

from dreamdrive_bench.commands import script

script("table1", __name__)
