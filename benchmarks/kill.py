"""The same as ``python -m dreamdrive_bench kill``."""

from dreamdrive_bench.commands import script

script("kill", __name__)
