"""The same as ``python -m dreamdrive_bench evaluate``."""

from dreamdrive_bench.commands import script

script("evaluate", __name__)
