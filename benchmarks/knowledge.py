"""The same as ``python -m dreamdrive_bench knowledge``."""

from dreamdrive_bench.commands import script

script("knowledge", __name__)
