"""The same as ``python -m dreamdrive_bench training``."""

from dreamdrive_bench.commands import script

script("training", __name__)
