"""The same as ``python -m dreamdrive_bench photo``."""

from dreamdrive_bench.commands import script

script("photo", __name__)
