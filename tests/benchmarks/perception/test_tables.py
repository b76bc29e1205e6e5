"""Figures of the experiment, from counts that can be added up by hand."""

import pytest

from dreamdrive_bench.perception.protocol import PROTOCOL, read_protocol
from dreamdrive_bench.perception.tables import counts_of, difference, iou, published, tables


def row(arm: str, seed: int, hits: int) -> dict[str, object]:
    """Two streets; of the second nothing is found."""

    def counts(found: int) -> dict[str, list[float]]:
        return {"thresholds": [0.4, 0.5], "hits": [99, found], "false_alarms": [0, 10], "misses": [0, 50]}

    streets = {"one": counts(hits), "two": counts(0)}
    made = {street: {"vehicle": of, "road": of, "vehicle_all": of} for street, of in streets.items()}
    return {"key": "k", "arm": arm, "seed": seed, "samples": 3, "validation": made}


def test_cells_of_all_streets_count_together_at_one_half() -> None:
    counts = counts_of(
        [row("real", 1, 40), row("real", 0, 80), row("warped", 0, 7)], "real", "validation", "road"
    )
    assert counts.tolist() == [[[80, 10, 50], [0, 10, 50]], [[40, 10, 50], [0, 10, 50]]]
    assert iou(counts) == pytest.approx(100 * (80 / 200 + 40 / 160) / 2)


def test_a_difference_lies_in_its_interval() -> None:
    rows = [
        row(arm, seed, hits + seed) for arm, hits in (("real", 40), ("generated", 80)) for seed in range(3)
    ]
    one, other = (counts_of(rows, arm, "validation", "road") for arm in ("real", "generated"))
    mean, low, high = difference(one, other)
    assert low <= mean <= high
    assert mean == pytest.approx(iou(other) - iou(one))
    assert difference(one, one)[0] == 0


def test_arms_without_networks_have_no_figures_and_unknown_pairs_no_row() -> None:
    text = tables([row("real", 0, 40)], read_protocol())
    assert "| real | 3 | 25.00 | 25.00 |" in text
    assert "| oracle | - | - | - |" in text
    longer = read_protocol(PROTOCOL.with_name("longer.json"))
    assert "only over oracle" in text
    assert "only over oracle" not in tables([row("real", 0, 40)], longer)


def test_what_is_published_is_what_figures_follow_from() -> None:
    assert published(row("real", 0, 40)) == {
        "arm": "real",
        "seed": 0,
        "samples": 3,
        "validation": {
            "one": {"vehicle": [40, 10, 50], "road": [40, 10, 50]},
            "two": {"vehicle": [0, 10, 50], "road": [0, 10, 50]},
        },
    }
