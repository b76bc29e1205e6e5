"""The same as ``python -m dreamdrive_bench trust``."""

from dreamdrive_bench.commands import script

script("trust", __name__)
