"""The same as ``python -m dreamdrive_bench wild``."""

from dreamdrive_bench.commands import script

script("wild", __name__)
