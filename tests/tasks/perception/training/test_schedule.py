"""The rates of one cycle against torch's, at which the original was trained."""

import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.tasks.perception import ScheduleOptions, make_optimiser, set_rate
from tests.golden.reading import values
from tests.tasks.perception.streets import tiny_network


def test_golden_rates() -> None:
    options = ScheduleOptions()
    for step, rate in values("eval/cvt_lr_schedule.json").items():
        assert options.rate_at(int(step)) == pytest.approx(rate, rel=1e-9), step


@pytest.mark.parametrize(("steps", "rising"), [(10, 0.3), (37, 0.5), (200, 0.05)])
def test_all_rates_are_those_of_torch(steps: int, rising: float) -> None:
    options = ScheduleOptions(steps=steps, rate=0.01, rising=rising, start=0.2, end=0.02)
    optimiser = torch.optim.AdamW([torch.nn.Parameter(torch.zeros(1))], lr=1.0)
    theirs = torch.optim.lr_scheduler.OneCycleLR(
        optimiser,
        max_lr=0.01,
        total_steps=steps,
        pct_start=rising,
        div_factor=5,
        final_div_factor=10,
        cycle_momentum=False,
    )
    for step in range(steps):
        assert options.rate_at(step) == pytest.approx(theirs.get_last_lr()[0], rel=1e-9)
        if step + 1 < steps:
            optimiser.step()
            theirs.step()


def test_an_optimiser_takes_the_rate() -> None:
    options = ScheduleOptions(steps=100)
    optimiser = make_optimiser(tiny_network(), options)
    assert optimiser.param_groups[0]["lr"] == pytest.approx(4e-4)
    assert optimiser.param_groups[0]["weight_decay"] == 1e-7
    set_rate(optimiser, 99, options)
    assert optimiser.param_groups[0]["lr"] == pytest.approx(4e-5)


def test_one_step_alone() -> None:
    assert ScheduleOptions(steps=1).rate_at(0) == pytest.approx(4e-5)


def test_what_is_no_schedule_is_refused() -> None:
    with pytest.raises(InputError, match="expected 1 or more"):
        ScheduleOptions(steps=0)
