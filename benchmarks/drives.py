"""The same as ``python -m dreamdrive_bench drives``."""

from dreamdrive_bench.commands import script

script("drives", __name__)
