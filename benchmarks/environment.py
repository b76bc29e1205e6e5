"""The same as ``python -m dreamdrive_bench environment``."""

from dreamdrive_bench.commands import script

script("environment", __name__)
