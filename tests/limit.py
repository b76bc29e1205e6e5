"""What takes longer than three seconds is marked slow: an unmarked test that does fails and says so.

Counted is the processor time of the test, of its own fixtures and of the processes that it waited for,
or the time that passed where that is less, as threads share the work. So waiting is not held against a
test. Fixtures that several tests share count for none. Who comes too late is judged by how fast the
machine is at that moment, and not at all while it has more to do than it has cores: threads that wait
for one another then count as work.
"""

import os
import sys
import time
from collections.abc import Callable, Generator
from statistics import median

import numpy as np
import pytest

REFERENCE_S = 0.020
"""What ``slowness`` times, on the machine for which the limit is meant: one of two cores of an AMD EPYC."""
LOADING_S = 0.01
"""For each module that a test happens to be the first to load."""

MOST_LOAD = 2.5
"""For each core. Two workers on two cores make 1.0, and threads and processes of tests some more."""

_own = pytest.StashKey[np.ndarray]()


def slowness() -> float:
    """How much longer this machine takes at present than the one for which the limit is meant; at least 1."""

    def once() -> float:
        start = time.thread_time()
        sorted(str(number * 7919 % 10007) for number in range(100_000))
        return time.thread_time() - start

    return max(1.0, median(once() for _ in range(5)) / REFERENCE_S)


def load() -> float:
    """How many processes each core had to run in the last minute."""
    return os.getloadavg()[0] / (os.cpu_count() or 1)


class Limit:
    """A plugin that times tests."""

    def __init__(
        self,
        limit_s: float = 3.0,
        slowness: Callable[[], float] = slowness,
        load: Callable[[], float] = load,
    ) -> None:
        self._limit_s, self._slowness, self._load = limit_s, slowness, load
        self._shared = np.zeros(2)

    def _spent(self) -> np.ndarray:
        """Seconds of processor time and seconds that passed, but for fixtures that several tests share."""
        return np.array([sum(os.times()[:4]), time.perf_counter()]) - self._shared

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(
        self, fixturedef: pytest.FixtureDef[object], request: pytest.FixtureRequest
    ) -> Generator[None, object, object]:
        """Add what a test's own fixtures take to the test, and leave out all others."""
        start = self._spent()
        try:
            return (yield)
        finally:
            taken = self._spent() - start
            if fixturedef.scope == "function":
                request.node.stash[_own] = request.node.stash.get(_own, np.zeros(2)) + taken
            else:
                self._shared += taken

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Generator[None, object, object]:
        """Fail a test that takes too long and is not marked."""
        start, loaded = self._spent() - item.stash.get(_own, np.zeros(2)), len(sys.modules)
        result = yield
        taken_s = min(self._spent() - start) - LOADING_S * (len(sys.modules) - loaded)
        if taken_s > self._limit_s and self._load() < MOST_LOAD and _judged(item):
            allowed_s = self._limit_s * self._slowness()
            if taken_s > allowed_s:
                said = f"it took {taken_s:.1f} s, and {allowed_s:.1f} s are allowed"
                pytest.fail(f"{said}: make it smaller, or mark it slow", pytrace=False)
        return result


def _judged(item: pytest.Item) -> bool:
    """Not what is marked, nor under a debugger or while lines are counted: times mean nothing there."""
    marked = any(item.get_closest_marker(name) for name in ("slow", "gpu"))
    return not (marked or sys.gettrace() or sys.getprofile())
