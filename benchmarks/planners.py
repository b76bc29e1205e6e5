"""The same as ``python -m dreamdrive_bench planners``."""

from dreamdrive_bench.commands import script

script("planners", __name__)
