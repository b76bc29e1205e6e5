"""Losses and their gradients against the original's; what is counted is in ``test_metric``."""

import math

import pytest
import torch

from dreamdrive.tasks.perception import LAYERS, BevPrediction, BevTruth, LossOptions, bev_losses, focal_loss
from tests.golden.reading import close, tensors, values
from tests.tasks.perception.golden_labels import layers, logits, truth

NUMBERS, TABLE = "eval/cvt_loss_metric.npz", "eval/cvt_loss_metric.json"


def test_golden_loss_of_vehicles() -> None:
    wanted, numbers = values(TABLE), tensors(NUMBERS)
    vehicle, centre = logits("pred"), logits("center_pred")
    parts = bev_losses(BevPrediction(vehicle, centre), truth())
    assert float(parts["vehicle"].detach()) == pytest.approx(wanted["vehicle_visible"], rel=1e-6)
    assert float(parts["centre"].detach()) == pytest.approx(0.1 * wanted["vehicle_center"], rel=1e-6)
    total = parts["vehicle"] + parts["centre"]
    assert float(total.detach()) == pytest.approx(wanted["vehicle_total"], rel=1e-6)
    total.backward()
    assert vehicle.grad is not None
    assert centre.grad is not None
    close(vehicle.grad, numbers["grad_vehicle_bev"][:, 0], 1e-6)
    close(centre.grad, numbers["grad_vehicle_center"][:, 0], 1e-6)


def test_golden_loss_of_road() -> None:
    wanted, road = values(TABLE), logits("pred")
    parts = bev_losses(BevPrediction(road=road), truth())
    assert set(parts) == {"road", "road_entropy"}
    assert float(parts["road"].detach()) == pytest.approx(wanted["road_focal"], rel=1e-6)
    assert float(parts["road_entropy"].detach()) == pytest.approx(0.1 * wanted["road_bce"], rel=1e-6)
    total = parts["road"] + parts["road_entropy"]
    assert float(total.detach()) == pytest.approx(wanted["road_total"], rel=1e-6)
    total.backward()
    assert road.grad is not None
    close(road.grad, tensors(NUMBERS)["grad_road_bev"][:, 0], 1e-6)


def test_golden_weights_of_ones() -> None:
    cars = layers()[:, LAYERS.index("car")].float()
    found = focal_loss(logits("pred").detach(), cars, alpha=0.25).mean()
    assert float(found) == pytest.approx(values(TABLE)["focal_alpha_0.25_mean"], rel=1e-6)


@pytest.mark.parametrize(("gamma", "alpha"), [(2.0, -1.0), (1.5, 0.25), (2.0, 0.0)])
def test_gradients(gamma: float, alpha: float) -> None:
    torch.manual_seed(0)
    said = torch.randn(3, 4, dtype=torch.float64, requires_grad=True)
    target = torch.rand(3, 4, dtype=torch.float64)
    assert torch.autograd.gradcheck(lambda x: focal_loss(x, target, gamma, alpha), said)


def test_without_gamma_it_is_cross_entropy() -> None:
    said, target = torch.randn(5, 6), torch.rand(5, 6)
    wanted = torch.nn.functional.binary_cross_entropy_with_logits(said, target, reduction="none")
    torch.testing.assert_close(focal_loss(said, target, gamma=0.0), wanted)


def test_where_no_cell_counts_nothing_is_learned() -> None:
    said = BevPrediction(*(torch.randn(1, 2, 2, requires_grad=True) for _ in range(2)))
    ones = torch.ones(1, 2, 2, dtype=torch.uint8)
    hidden = BevTruth(ones, ones.float(), visibility=ones, road=ones)
    parts = bev_losses(said, hidden)
    assert {name: float(value.detach()) for name, value in parts.items()} == {"vehicle": 0.0, "centre": 0.0}
    parts["vehicle"].backward()
    assert said.vehicle is not None
    assert said.vehicle.grad is not None
    assert not said.vehicle.grad.any()
    as_published = bev_losses(said, hidden, LossOptions(empty_is_nan=True))
    assert all(math.isnan(float(value.detach())) for value in as_published.values())


def test_vehicles_that_weigh_more_are_said_at_lower_odds() -> None:
    """At one half the gradients of both sides are equal where a share of 1 - alpha is a vehicle."""
    for alpha, share in ((0.75, 0.25), (0.5, 0.5)):
        found = torch.zeros(100, requires_grad=True)
        target = (torch.arange(100) < 100 * share).float()
        focal_loss(found, target, 2.0, alpha).sum().backward()
        assert found.grad is not None
        assert float(found.grad.sum()) == pytest.approx(0, abs=1e-6)
    said, labels = BevPrediction(logits("pred"), logits("center_pred")), truth()
    even = bev_losses(said, labels, LossOptions(alpha=0.5))["vehicle"]
    torch.testing.assert_close(even, bev_losses(said, labels)["vehicle"])
