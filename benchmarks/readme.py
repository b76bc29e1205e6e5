"""The same as ``python -m dreamdrive_bench readme``."""

from dreamdrive_bench.commands import script

script("readme", __name__)
