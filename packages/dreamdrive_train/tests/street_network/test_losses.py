from dataclasses import replace
from math import log

import pytest
import torch
from torch import Tensor

from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.street_network.prediction import Prediction
from dreamdrive_train.street_network.losses import (
    StreetLossOptions,
    camera_losses,
    centre_loss,
    class_loss,
    depth_losses,
    losses,
    taught_losses,
)
from dreamdrive_train.street_network.targets import Batch

EVEN = (1.0,) * 11
HEIGHT, WIDTH = 8, 12


def batch(**changes: Tensor) -> Batch:
    """Two pictures of which nothing is known."""
    size = 2, HEIGHT, WIDTH
    nothing = Batch(
        pictures=torch.zeros(2, 3, 2 * HEIGHT, 2 * WIDTH, dtype=torch.uint8),
        labels=torch.full(size, 255, dtype=torch.uint8),
        depth_m=torch.zeros(size),
        centre=torch.zeros(2, 3, HEIGHT // 2, WIDTH // 2),
        centre_known=torch.zeros(2, HEIGHT // 2, WIDTH // 2, dtype=torch.bool),
        offset=torch.zeros(2, 2, HEIGHT // 2, WIDTH // 2),
        on_road_user=torch.zeros(2, HEIGHT // 2, WIDTH // 2, dtype=torch.bool),
        camera=torch.full((2, 3), torch.nan),
        camera_height_m=torch.full((2,), torch.nan),
        distorted=torch.full((2,), torch.nan),
        taught=torch.zeros(2, dtype=torch.bool),
        clean=torch.zeros(0, 3, 2 * HEIGHT, 2 * WIDTH, dtype=torch.uint8),
    )
    return replace(nothing, **changes)


def answer(seed: int = 0, **changes: Tensor) -> Prediction:
    generator = torch.Generator().manual_seed(seed)

    def drawn(*shape: int) -> Tensor:
        return torch.randn(2, *shape, generator=generator).requires_grad_()

    said = Prediction(
        log_depth=drawn(HEIGHT, WIDTH),
        log_spread=drawn(HEIGHT, WIDTH),
        classes=drawn(11, HEIGHT, WIDTH),
        centre=drawn(3, HEIGHT // 2, WIDTH // 2),
        offset=drawn(2, HEIGHT // 2, WIDTH // 2),
        camera=drawn(7),
    )
    return replace(said, **changes)


def test_what_is_not_known_costs_nothing_and_teaches_nothing() -> None:
    said = answer()
    parts = losses(said, batch(), StreetLossOptions())
    assert {name: float(value.detach()) for name, value in parts.items()} == dict.fromkeys(parts, 0.0)
    torch.stack(list(parts.values())).sum().backward()
    for value in vars(said).values():
        assert value is None or value.grad is None or not value.grad.any()


def test_a_set_of_classes_is_content_with_any_of_them() -> None:
    labels = torch.full((2, HEIGHT, WIDTH), 32, dtype=torch.uint8)  # road or marking
    logits = torch.full((2, 11, HEIGHT, WIDTH), -20.0)
    for sure in (StreetClass.ROAD, StreetClass.MARKING):
        said = logits.clone()
        said[:, sure] = 20
        assert class_loss(said, labels, EVEN) == pytest.approx(0, abs=1e-5)
    said = logits.clone()
    said[:, StreetClass.SKY] = 20
    assert class_loss(said, labels, EVEN) == pytest.approx(40 - log(2), rel=1e-3)


def test_one_class_costs_what_cross_entropy_does() -> None:
    labels = torch.arange(2 * HEIGHT * WIDTH).view(2, HEIGHT, WIDTH) % 11
    said = answer().classes
    wanted = torch.nn.functional.cross_entropy(said, labels)
    torch.testing.assert_close(class_loss(said, labels.to(torch.uint8), EVEN), wanted)


def test_depth_up_to_a_factor_where_the_height_is_unknown() -> None:
    depth = torch.rand(2, HEIGHT, WIDTH) * 50 + 1
    spread = torch.zeros_like(depth)
    for factor in (0.2, 7.0):
        scaled = depth_losses((factor * depth).log(), spread, batch(depth_m=depth), 0.3)
        assert [float(each) for each in scaled] == pytest.approx([0, 0, 0], abs=1e-5)
    known = batch(depth_m=depth, camera_height_m=torch.tensor([1.5, 1.5]))
    right = depth_losses((depth / 1.5).log(), spread, known, 0.3)[0]
    double = depth_losses((2 * depth / 1.5).log(), spread, known, 0.3)[0]
    assert [float(right), float(double)] == pytest.approx([0, 0.3 * log(2)], abs=1e-5)


def test_the_best_spread_is_the_mean_error() -> None:
    depth = torch.ones(2, HEIGHT, WIDTH)
    error = 0.2 * torch.where(torch.arange(WIDTH) % 2 == 0, 1.0, -1.0).expand(2, HEIGHT, WIDTH)
    known = batch(depth_m=depth, camera_height_m=torch.ones(2))
    spread = torch.full_like(depth, log(0.2)).requires_grad_()
    depth_losses(error, spread, known, 1.0)[0].backward()
    assert spread.grad is not None
    assert float(spread.grad.abs().max()) < 1e-6


def test_what_is_far_may_be_farther() -> None:
    depth = torch.full((2, HEIGHT, WIDTH), torch.inf)
    depth[:, : HEIGHT // 2 + 1] = 10.0
    known = batch(depth_m=depth, camera_height_m=torch.ones(2))
    said = torch.where(torch.isinf(depth), 5000.0, 10.0).log()
    assert float(depth_losses(said, torch.zeros_like(said), known, 0.3)[2]) == 0
    near = torch.where(torch.isinf(depth), 25.6, 10.0).log()
    assert float(depth_losses(near, torch.zeros_like(near), known, 0.3)[2]) == pytest.approx(
        log(10), rel=1e-3
    )


def test_centres_are_found_and_none_elsewhere() -> None:
    peaks = torch.zeros(2, 3, 4, 6)
    peaks[0, 1, 2, 3] = 1
    known = torch.ones(2, 4, 6, dtype=torch.bool)
    right = torch.where(peaks == 1, 20.0, -20.0)
    assert float(centre_loss(right, peaks, known)) == pytest.approx(0, abs=1e-6)
    assert float(centre_loss(-right, peaks, known)) > 20
    assert float(centre_loss(-right, peaks, torch.zeros_like(known))) == 0


def test_the_camera_by_its_spread_where_it_is_known() -> None:
    said = torch.tensor([[0.1, 0.0, 0.0, -2.0, -2, -2, 5], [0.1, 0, 0, 0, 0, 0, 5]]).requires_grad_()
    camera = torch.tensor([[0.3, torch.nan, torch.nan], [torch.nan] * 3])
    distorted = torch.tensor([1.0, torch.nan])
    error, bent = camera_losses(said, batch(camera=camera, distorted=distorted))
    assert float(bent.detach()) < 0.01
    error.backward()
    assert said.grad is not None
    assert said.grad[0, 0] < 0  # the focal length shall grow
    assert not said.grad[1].any()
    assert not said.grad[0, 1:3].any()


def test_the_teacher_is_believed_where_it_is_sure_and_nothing_else_is_known() -> None:
    teacher = answer(1)
    sure = torch.zeros(2, 11, HEIGHT, WIDTH)
    sure[:, 3, :, : WIDTH // 2] = 20  # it is unsure of the right half; the student sees it mirrored
    teacher = replace(teacher, classes=sure)
    one = torch.tensor([True, False])
    said = answer()
    only = replace(teacher, **{k: v[:1] for k, v in vars(teacher).items() if v is not None})
    parts = taught_losses(said, only, batch(taught=one), StreetLossOptions())
    torch.stack(list(parts.values())).sum().backward()
    assert said.classes.grad is not None
    assert said.log_depth.grad is not None
    assert said.classes.grad[0, :, :, WIDTH // 2 :].abs().min() > 0
    assert not said.classes.grad[0, :, :, : WIDTH // 2].any()
    assert said.log_depth.grad[0].any()
    assert not said.classes.grad[1].any()
    assert not said.log_depth.grad[1].any()
    labelled = batch(taught=one, labels=torch.zeros(2, HEIGHT, WIDTH, dtype=torch.uint8))
    assert float(taught_losses(said, only, labelled, StreetLossOptions())["taught_classes"].detach()) == 0
