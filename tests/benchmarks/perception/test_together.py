"""Steps that a GPU takes for many networks are those of the training, here on the CPU."""

import json
from dataclasses import replace

import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.street_network import SHIPPED
from dreamdrive.tasks.perception import (
    BevSet,
    CvtTraining,
    Regime,
    ScheduleOptions,
    samples_of_log,
    train_on,
    write_bev_set,
)
from dreamdrive.tasks.perception.readings import first_network
from dreamdrive_bench.perception.together import Student, held
from tests.logs import log
from tests.tasks.perception.streets import ON_STREET_TRUNK as TINY


def regime(frozen_layers: int) -> Regime:
    training = CvtTraining(
        schedule=ScheduleOptions(steps=4),
        frozen_layers=frozen_layers,
        log_each=1,
    )
    return Regime(TINY, training, batch=2)


@pytest.fixture(scope="module")
def bev_set(tmp_path_factory):
    folder = tmp_path_factory.mktemp("together")
    samples = samples_of_log(log(folder / "made", "one"), TINY.image, TINY.grid)
    write_bev_set(samples, folder / "set", TINY.image, TINY.grid, count=3)
    return BevSet.open(folder / "set")


@pytest.mark.parametrize("frozen_layers", [2, 3])
def test_a_student_learns_as_a_training_does(bev_set, tmp_path, frozen_layers):
    asked = replace(regime(frozen_layers), trunk=SHIPPED)
    assert train_on([bev_set], tmp_path, asked) is not None
    wanted = [json.loads(line)["loss"] for line in (tmp_path / "losses.jsonl").read_text().splitlines()]
    student = Student(held([bev_set], asked, torch.device("cpu")), asked)
    for _ in range(3):  # as before a capture
        student.step()
    student.start_again(first_network(asked).state_dict())
    for _ in range(4):
        student.step()
    torch.testing.assert_close(student.losses, torch.tensor(wanted), rtol=2e-3, atol=1e-5)


def test_a_stopped_student_goes_on_as_if_it_had_not_been(bev_set, tmp_path):
    asked, data = replace(regime(2), trunk=SHIPPED), {"trial": "one"}
    samples = held([bev_set], asked, torch.device("cpu"))
    whole, first, second = (Student(samples, asked) for _ in range(3))
    assert list(whole.learn()) == []  # too few steps to tell of
    second.go_on(tmp_path, data)  # nothing is there yet
    for _ in range(2):
        first.step()
    first.save(tmp_path, data)
    second.go_on(tmp_path, data)
    list(second.learn())
    assert torch.equal(second.losses[2:], whole.losses[2:])
    for one, other in zip(second.network.parameters(), whole.network.parameters(), strict=True):
        assert torch.equal(one, other)
    with pytest.raises(InputError, match="other options or data"):
        first.go_on(tmp_path, {"trial": "two"})


def test_a_network_that_broke_is_not_kept(bev_set, monkeypatch):
    monkeypatch.setattr("dreamdrive_bench.perception.together._SAID_EACH", 1)
    asked = replace(regime(2), trunk=SHIPPED)
    student = Student(held([bev_set], asked, torch.device("cpu")), asked)
    student.losses[3] = torch.nan
    with pytest.raises(ArithmeticError, match="not finite"):
        next(student.learn())


def test_what_learns_early_is_not_held(bev_set):
    with pytest.raises(InputError, match="two frozen layers or more"):
        held([bev_set], regime(1), torch.device("cpu"))


def test_a_set_may_count_several_times(bev_set):
    asked, device = regime(2), torch.device("cpu")
    one, three = held([bev_set], asked, device), held([bev_set] * 3, asked, device)
    assert (len(one), len(three)) == (3, 9)
    assert torch.equal(one.fine, three.fine)
    rows = torch.tensor([1, 4, 7])
    assert torch.equal(three.rows(rows).fine, one.fine[[1, 1, 1]])
