"""The same as ``python -m dreamdrive_bench train_step``."""

from dreamdrive_bench.commands import script

script("train_step", __name__)
