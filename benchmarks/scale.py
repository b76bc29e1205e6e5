"""The same as ``python -m dreamdrive_bench scale``."""

from dreamdrive_bench.commands import script

script("scale", __name__)
