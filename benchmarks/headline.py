"""The same as ``python -m dreamdrive_bench headline``."""

from dreamdrive_bench.commands import script

script("headline", __name__)
