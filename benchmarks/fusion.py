"""The same as ``python -m dreamdrive_bench fusion``."""

from dreamdrive_bench.commands import script

script("fusion", __name__)
