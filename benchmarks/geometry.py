"""The same as ``python -m dreamdrive_bench geometry``."""

from dreamdrive_bench.commands import script

script("geometry", __name__)
