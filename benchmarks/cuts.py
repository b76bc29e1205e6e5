"""The same as ``python -m dreamdrive_bench cuts``."""

from dreamdrive_bench.commands import script

script("cuts", __name__)
