"""The same as ``python -m dreamdrive_bench removed``."""

from dreamdrive_bench.commands import script

script("removed", __name__)
