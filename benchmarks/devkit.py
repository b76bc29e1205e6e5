"""The same as ``python -m dreamdrive_bench devkit``."""

from dreamdrive_bench.commands import script

script("devkit", __name__)
