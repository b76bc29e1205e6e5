import math

import pytest

from dreamdrive.errors import InputError
from dreamdrive.tasks.environment.bicycle import EgoOptions, EgoState
from dreamdrive.tasks.environment.path import OnPath
from dreamdrive.tasks.environment.reward import Reward, RewardOptions, reward_of

EGO, WEIGHTS = EgoOptions(), RewardOptions()
BEFORE, AFTER = OnPath(10.0, 0.2, 0.0), OnPath(10.9, -0.5, 0.0)


def reward(state: EgoState, weights: RewardOptions = WEIGHTS, **more: bool) -> Reward:
    ends = {"hit": False, "off_road": False, **more}
    return reward_of(BEFORE, AFTER, state, step_s=0.1, ego=EGO, weights=weights, **ends)


def test_each_term_counts_in_its_unit() -> None:
    state = EgoState(0.0, 0.0, 0.0, 10.0, 0.05, -2.0)
    across = 10.0 * state.yaw_rate_rad_s(EGO)
    found = reward(state, RewardOptions(progress=2.0, aside=3.0, comfort=0.1))
    assert found.progress == pytest.approx(2.0 * 0.9)
    assert found.aside == pytest.approx(-3.0 * 0.5 * 0.1)
    assert found.comfort == pytest.approx(-0.1 * (4.0 + across**2) * 0.1)
    assert (found.collision, found.off_road) == (0, 0)
    assert found.total == pytest.approx(found.progress + found.aside + found.comfort)


def test_the_ends_cost_once() -> None:
    state = EgoState(0.0, 0.0, 0.0, 10.0)
    assert reward(state, hit=True).total == pytest.approx(reward(state).total - 50)
    assert reward(state, RewardOptions(off_road=7.0), off_road=True).off_road == -7.0


@pytest.mark.parametrize("weight", [-1.0, math.nan, math.inf])
def test_weights_are_numbers_of_0_or_more(weight: float) -> None:
    with pytest.raises(InputError, match="finite weights of 0 or more"):
        RewardOptions(comfort=weight)
