"""The same as ``python -m dreamdrive_bench ablation``."""

from dreamdrive_bench.commands import script

script("ablation", __name__)
