"""The same as ``python -m dreamdrive_bench surround``."""

from dreamdrive_bench.commands import script

script("surround", __name__)
