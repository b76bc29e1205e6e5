"""Intersection over union against the original's, pooled over batches."""

import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.tasks.perception import BevPrediction, BevTruth, bev_counts, iou_counts
from tests.golden.reading import values
from tests.tasks.perception.golden_labels import logits, truth

NAMES = {"vehicle": "iou_vehicle_vis2", "vehicle_all": "iou_vehicle_all", "road": "iou_road"}


def part_of(given: BevTruth, rows: slice) -> BevTruth:
    return BevTruth(given.vehicle[rows], given.centre[rows], given.visibility[rows], given.road[rows])


@pytest.mark.parametrize("pooled", [False, True])
def test_golden_counts(pooled: bool) -> None:
    wanted, said, labels = values("eval/cvt_loss_metric.json"), logits("pred"), truth()
    parts = [slice(0, 1), slice(1, None)] if pooled else [slice(None)]
    batches = [
        bev_counts(BevPrediction(said[rows], said[rows], said[rows]), part_of(labels, rows)) for rows in parts
    ]
    for name, theirs in NAMES.items():
        found = batches[0][name] if len(batches) == 1 else batches[0][name] + batches[1][name]
        assert found.samples == len(said)
        assert list(found.hits) == wanted[theirs]["tp"]
        assert list(found.false_alarms) == wanted[theirs]["fp"]
        assert list(found.misses) == wanted[theirs]["fn"]
        for threshold, value in found.iou().items():
            # theirs is of float32
            assert value == pytest.approx(wanted[theirs]["values"][f"@{threshold:.2f}"], rel=1e-6)


def test_hidden_cells_do_not_count() -> None:
    said, labels = torch.tensor([[[9.0, -9.0, 9.0]]]), torch.tensor([[[1, 1, 0]]], dtype=torch.uint8)
    kept = torch.tensor([[[True, False, False]]])
    assert iou_counts(said, labels, kept).iou()[0.5] == pytest.approx(1.0)
    assert iou_counts(said, labels).iou()[0.5] == pytest.approx(1 / 3)


def test_a_threshold_is_itself_a_yes() -> None:
    labels = torch.ones(1, 1, 1, dtype=torch.uint8)
    assert iou_counts(torch.zeros(1, 1, 1), labels, thresholds=(0.5,)).hits == (1,)


def test_only_what_is_segmented_is_counted() -> None:
    labels = truth()
    assert set(bev_counts(BevPrediction(road=logits("pred")), labels)) == {"road"}


def test_counts_at_other_thresholds_do_not_add_up() -> None:
    labels = torch.ones(1, 1, 1, dtype=torch.uint8)
    one, other = (iou_counts(torch.zeros(1, 1, 1), labels, thresholds=(t,)) for t in (0.4, 0.5))
    with pytest.raises(InputError, match="do not add up"):
        _ = one + other
