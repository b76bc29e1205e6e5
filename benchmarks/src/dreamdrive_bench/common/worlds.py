"""Which drawn worlds and recorded clips the project was developed on, and which it is judged by."""

from collections.abc import Hashable, Iterable, Mapping

EDITION = 1
"""Of the drawn worlds, see ``dreamdrive.scene.street.layout.EDITIONS``."""
DEVELOPMENT = tuple(range(8))
"""Seeds of the worlds that thresholds and options were chosen on."""
TEST = tuple(range(1000, 1016))
"""Seeds of worlds that no choice was made on; they are measured, and nothing else."""
SETS = {"development": DEVELOPMENT, "test": TEST}
DEVELOPMENT_CLIPS = (
    "pandaset_002",
    "kitti_odom04_follow_van",
    "kitti_odom06_avenue",
    "kitti_odom07_left_turn",
    "udacity_highway_two_cars",
    "udacity_highway_open",
    "opensfm_lund_walk",
)
"""All recorded clips: thresholds were set on them, and none is kept for a test."""


def set_of(seeds: Iterable[int]) -> str:
    """The name of the one set that some worlds are of; ``"other"`` for worlds of neither.

    Raises:
        ValueError: They are of several sets: worlds that choices were made on do not vouch for the others.
    """
    names = {next((name for name, known in SETS.items() if seed in known), "other") for seed in seeds}
    if len(names) > 1:
        raise ValueError(f"no mean is taken over worlds of several sets: {', '.join(sorted(names))}")
    return names.pop() if names else "other"


def common_worlds(found: Iterable[Mapping[str, Hashable]], by: str) -> list[int]:
    """Seeds that every value of a column was measured on: means over different worlds cannot be compared.

    Args:
        found: Records with a ``seed``.
        by: Name of the column.
    """
    seeds: dict[Hashable, set[int]] = {}
    for record in found:
        seeds.setdefault(record[by], set()).add(int(str(record["seed"])))
    worlds = sorted(set.intersection(*seeds.values())) if seeds else []
    set_of(worlds)
    return worlds
