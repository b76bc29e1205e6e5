"""The time of a browser."""

import pytest

from dreamdrive.view.clock import Clock


def clock(first_s: float = 10.0, last_s: float = 12.0) -> tuple[Clock, list[float]]:
    now = [100.0]
    return Clock(first_s, last_s, now=lambda: now[0]), now


def test_it_stands_until_it_plays_and_runs_as_fast_as_told() -> None:
    made, now = clock()
    now[0] += 1
    assert made.tick() == 10
    made.play()
    now[0] += 0.5
    assert made.tick() == pytest.approx(10.5)
    made.speed = 2.0
    now[0] += 0.25
    assert made.tick() == pytest.approx(11.0)
    made.pause()
    now[0] += 5
    assert made.tick() == pytest.approx(11.0)


def test_it_begins_again_at_its_end() -> None:
    made, now = clock()
    made.play()
    now[0] += 5.5
    assert made.tick() == pytest.approx(11.5)
    made.set(99)
    assert made.t_s == 12
    made.play()
    assert made.t_s == 10


def test_other_bounds_keep_the_time_within_them() -> None:
    made, _ = clock()
    made.set(11.5)
    made.span(0.0, 11.0)
    assert made.t_s == 11
    made.span(11.0, 11.0)  # one frame
    made.play()
    assert made.tick() == 11
