"""The same as ``python -m dreamdrive_bench editing``."""

from dreamdrive_bench.commands import script

script("editing", __name__)
