"""The same as ``python -m dreamdrive_bench oracle``."""

from dreamdrive_bench.commands import script

script("oracle", __name__)
