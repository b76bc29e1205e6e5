"""The same as ``python -m dreamdrive_bench gpu``."""

from dreamdrive_bench.commands import script

script("gpu", __name__)
