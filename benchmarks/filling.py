"""The same as ``python -m dreamdrive_bench filling``."""

from dreamdrive_bench.commands import script

script("filling", __name__)
