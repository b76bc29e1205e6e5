import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest
import torch

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.errors import InputError
from dreamdrive.tasks.perception import (
    BevBatch,
    CrossViewTransformer,
    CvtTraining,
    LossOptions,
    ScheduleOptions,
    bev_counts,
    load_cvt,
    make_optimiser,
    train_cvt,
)
from dreamdrive.tasks.perception.training.replicas import replicated
from dreamdrive.tasks.perception.training.training import LOG
from tests.tasks.perception.streets import TINY, Stub, street, tiny_network

SHORT = CvtTraining(ScheduleOptions(steps=6), log_each=1)
WITH_TRUNK = replace(TINY, trunk_width=0.25)


def batches(first: int) -> Iterator[BevBatch]:
    return (street(step, batch=4) for step in count(first))


def network() -> CrossViewTransformer:
    """With a trunk that drops samples at random."""
    torch.manual_seed(0)
    return CrossViewTransformer(WITH_TRUNK)


def lines(folder: Path) -> list[dict[str, float]]:
    return [json.loads(line) for line in (folder / LOG).read_text().splitlines()]


@pytest.mark.parametrize("replicas", [1, 2])
def test_a_stopped_training_goes_on_as_if_it_had_not_been(tmp_path: Path, replicas: int) -> None:
    options = replace(SHORT, replicas=replicas)
    told: list[tuple[int, int]] = []
    with one_torch_thread():  # sums of several threads are not always in one order
        whole = train_cvt(
            network(), batches, tmp_path / "whole", options, data={}, progress=lambda *each: told.append(each)
        )
        asked = iter([False, False, True])
        part = tmp_path / "part"
        assert train_cvt(network(), batches, part, options, data={}, stop=lambda: next(asked)) is None
        assert len(lines(part)) == 3
        assert not (part / "cvt.safetensors").exists()
        end = train_cvt(network(), batches, part, options, data={})
    assert told == [(step, 6) for step in range(1, 7)]
    assert whole is not None
    assert end is not None
    one, other = load_cvt(whole), load_cvt(end)
    assert one.options == WITH_TRUNK
    for (key, a), (_, b) in zip(one.state_dict().items(), other.state_dict().items(), strict=True):
        assert torch.equal(a, b), key
    for a, b in zip(lines(tmp_path / "whole"), lines(part), strict=True):
        assert {**a, "seconds": 0} == {**b, "seconds": 0}
    assert len(list(part.glob("checkpoint-*"))) == 1
    assert train_cvt(network(), batches, part, options, data={}) == end  # nothing is left to do


def test_another_training_is_refused(tmp_path: Path) -> None:
    train_cvt(tiny_network(), batches, tmp_path, SHORT, data={"set": "a"})
    with pytest.raises(InputError, match="other options or data"):
        train_cvt(tiny_network(), batches, tmp_path, replace(SHORT, clip=1.0), data={"set": "a"})
    with pytest.raises(InputError, match="other options or data"):
        train_cvt(tiny_network(), batches, tmp_path, SHORT, data={"set": "b"})


@pytest.mark.parametrize("low_precision", [False, True])
def test_losses_fall(tmp_path: Path, low_precision: bool) -> None:
    options = CvtTraining(ScheduleOptions(steps=40, rate=0.01), log_each=1, low_precision=low_precision)
    assert train_cvt(tiny_network(), batches, tmp_path, options, data={}) is not None
    found = lines(tmp_path)
    assert sum(each["loss"] for each in found[-5:]) < 0.5 * sum(each["loss"] for each in found[:5])
    parts = {"vehicle", "centre", "road", "road_entropy"}
    assert set(found[0]) == {"step", "seconds", "loss"} | parts
    assert found[0]["loss"] == pytest.approx(sum(found[0][name] for name in parts), abs=1e-5)


@pytest.mark.slow
def test_a_vehicle_is_found_where_it_is_seen(tmp_path: Path) -> None:
    options = CvtTraining(ScheduleOptions(steps=400, rate=0.01))
    path = train_cvt(tiny_network(), batches, tmp_path, options, data={})
    assert path is not None
    trained, unseen = load_cvt(path, backbone=Stub()), street(1_000_000, batch=8)
    with torch.no_grad():
        said = trained(unseen.pictures, unseen.pixel_from_camera, unseen.camera_from_ego)
    counts = bev_counts(said, unseen.truth)
    assert counts["vehicle"].iou()[0.5] > 0.9
    assert counts["road"].iou()[0.5] > 0.9


def test_replicas_learn_what_one_network_does() -> None:
    """But for the norms, which are frozen here: gradients are the mean of those of the parts."""
    whole, apart = tiny_network(), tiny_network()
    batch, losses = street(3, batch=4), LossOptions(visibility=0)
    found = []
    for each, count_of in ((whole, 1), (apart, 2)):
        each.eval()
        with replicated(each, count_of, losses, low_precision=False) as replicas:
            found.append(replicas.learn(batch, seed=0))
    for name, value in found[0].items():
        torch.testing.assert_close(found[1][name], value)
    for one, other in zip(whole.parameters(), apart.parameters(), strict=True):
        torch.testing.assert_close(one.grad, other.grad, rtol=1e-4, atol=1e-6)


def test_the_fused_optimiser_steps_as_the_plain_one() -> None:
    """It takes memory as it lies: gradients that lie otherwise than their weights would be mixed up."""
    fused, plain = network(), network()
    for each in (fused, plain):
        with replicated(each, 1, LossOptions(), low_precision=False) as replicas:
            replicas.learn(street(3, batch=4), seed=0)
    options = ScheduleOptions(steps=6)
    make_optimiser(fused, options).step()
    rate = options.rate_at(0)
    torch.optim.AdamW(plain.parameters(), lr=rate, weight_decay=options.weight_decay, foreach=False).step()
    for (name, one), other in zip(fused.named_parameters(), plain.parameters(), strict=True):
        torch.testing.assert_close(one, other, msg=name)


def test_replicas_are_for_cores(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="0 replicas on cpu"):
        train_cvt(tiny_network(), batches, tmp_path, replace(SHORT, replicas=0), data={})


def test_frozen_layers_stay_as_they_are(tmp_path: Path) -> None:
    before = {key: value.clone() for key, value in network().state_dict().items()}
    options = replace(SHORT, schedule=ScheduleOptions(steps=2), frozen_layers=2)
    path = train_cvt(network(), batches, tmp_path, options, data={})
    assert path is not None
    after = load_cvt(path).state_dict()
    same = {key for key, value in after.items() if torch.equal(value, before[key])}
    layers = [f"encoder.backbone.layers.{index}." for index in range(4)]
    assert {key for key in after if key.startswith((layers[0], layers[1]))} <= same
    assert "encoder.backbone.layers.2.0._bn1.running_mean" not in same
    assert "encoder.backbone.layers.3.0._project_conv.weight" not in same


def test_what_cannot_be_frozen_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="this backbone has 0 layers"):
        train_cvt(tiny_network(), batches, tmp_path, replace(SHORT, frozen_layers=1), data={})
    with pytest.raises(InputError, match="this backbone has 4 layers"):
        train_cvt(network(), batches, tmp_path, replace(SHORT, frozen_layers=5), data={})


def test_too_few_batches_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="end after step 2 of 6"):
        train_cvt(tiny_network(), lambda first: [street(0), street(1)], tmp_path, SHORT, data={})


def test_a_loss_that_is_not_finite_ends_it(tmp_path: Path) -> None:
    broken = tiny_network()
    torch.nn.init.constant_(broken.to_logits[3].bias, float("nan"))
    with pytest.raises(ArithmeticError, match="step 0 is not finite"):
        train_cvt(broken, batches, tmp_path, SHORT, data={})
