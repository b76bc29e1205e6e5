"""The same as ``python -m dreamdrive_bench planning``."""

from dreamdrive_bench.commands import script

script("planning", __name__)
