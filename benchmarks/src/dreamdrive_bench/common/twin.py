"""The twin of the street network that ships, which has seen nothing of what is measured.

Every published figure of what uses the network is made with it; see docs/reference/street_network.md.
"""

from pathlib import Path

from dreamdrive_bench.common.places import ROOT

TWIN = str(ROOT / "benchmarks/knowledge/twin.safetensors")


def name_of(knowledge: str) -> str:
    """How tables call what ``--knowledge`` takes: a name, or a file's name without its ending."""
    return Path(knowledge).stem
