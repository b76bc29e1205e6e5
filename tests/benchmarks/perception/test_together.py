"""Steps that a GPU takes for many networks are those of the training, here on the CPU."""

import json

import pytest
import torch
from tests.logs import log

from dreamdrive.perception import (
    BevGrid,
    BevSet,
    CvtOptions,
    CvtTraining,
    ImageSize,
    Regime,
    Samples,
    ScheduleOptions,
    samples_of_log,
    train_on,
    write_bev_set,
)
from dreamdrive.perception.readings import first_network
from perception.together import Student, held

TINY = CvtOptions(
    ImageSize(32, 64, 4), BevGrid(16, 16), ("vehicle", "road"), "street", dim=16, heads=2, head_dim=8,
    bottlenecks=(1, 1), decoder=(16, 16, 8), head=8,
)  # fmt: skip


def regime(frozen_layers: int, low_precision: bool = False) -> Regime:
    training = CvtTraining(
        schedule=ScheduleOptions(steps=4),
        frozen_layers=frozen_layers,
        low_precision=low_precision,
        log_each=1,
    )
    return Regime(TINY, training, batch=2)


@pytest.fixture(scope="module")
def bev_set(tmp_path_factory):
    folder = tmp_path_factory.mktemp("together")
    samples = samples_of_log(log(folder / "made", "one"), TINY.image, TINY.grid)
    write_bev_set(samples, folder / "set", TINY.image, TINY.grid, count=3)
    return BevSet.open(folder / "set")


@pytest.mark.parametrize("frozen_layers", [0, 2])
def test_a_student_learns_as_a_training_does(bev_set, tmp_path, frozen_layers):
    asked = regime(frozen_layers)
    assert train_on([bev_set], tmp_path, asked) is not None
    wanted = [json.loads(line)["loss"] for line in (tmp_path / "losses.jsonl").read_text().splitlines()]
    student = Student(held(Samples([bev_set]), torch.device("cpu")), asked)
    for _ in range(3):  # as before a capture
        student.step()
    student.start_again(first_network(asked).state_dict())
    for _ in range(4):
        student.step()
    torch.testing.assert_close(student.losses, torch.tensor(wanted), rtol=2e-3, atol=1e-5)


def test_features_of_a_trunk_that_does_not_learn_stand_for_the_pictures(bev_set):
    asked = regime(3, low_precision=True)
    pictures = held(Samples([bev_set]), torch.device("cpu"))
    features = pictures.as_seen_by(first_network(asked))
    one, other = Student(pictures, asked), Student(features, asked)
    for _ in range(2):
        one.step()
        other.step()
    torch.testing.assert_close(one.losses, other.losses, rtol=2e-2, atol=0)
