"""The same as ``python -m dreamdrive_bench clips``."""

from dreamdrive_bench.commands import script

script("clips", __name__)
