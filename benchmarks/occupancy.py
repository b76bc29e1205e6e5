"""The same as ``python -m dreamdrive_bench occupancy``."""

from dreamdrive_bench.commands import script

script("occupancy", __name__)
