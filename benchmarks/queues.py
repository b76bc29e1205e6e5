"""The same as ``python -m dreamdrive_bench queues``."""

from dreamdrive_bench.commands import script

script("queues", __name__)
