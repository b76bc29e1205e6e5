"""The same as ``python -m dreamdrive_bench completion``."""

from dreamdrive_bench.commands import script

script("completion", __name__)
