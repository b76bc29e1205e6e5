"""The same as ``python -m dreamdrive_bench perception``."""

from dreamdrive_bench.commands import script

script("perception", __name__)
