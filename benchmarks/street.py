"""The same as ``python -m dreamdrive_bench street``."""

from dreamdrive_bench.commands import script

script("street", __name__)
