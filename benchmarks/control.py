"""The same as ``python -m dreamdrive_bench control``."""

from dreamdrive_bench.commands import script

script("control", __name__)
