"""The same as ``python -m dreamdrive_bench splat``."""

from dreamdrive_bench.commands import script

script("splat", __name__)
