"""An unmarked test that takes too long fails, on any machine and under any load."""

import sys
from collections.abc import Callable

import pytest

from tests import limit

pytest_plugins = ["pytester"]

CONFTEST = """
from tests.limit import Limit

def pytest_configure(config):
    config.pluginmanager.register(Limit(0.15, lambda: {slowness}, lambda: {load}))
"""
WORK = """
import subprocess, sys, time
import pytest

def work(seconds=0.3):
    start = time.process_time()
    while time.process_time() - start < seconds:
        pass
"""
TOO_LONG = {
    "the test itself": "def test_it(): work()",
    "a process that it waits for": """
def test_it():
    code = "import time\\nwhile time.process_time() < 0.3: pass"
    subprocess.run([sys.executable, "-S", "-c", code], check=True)
""",
    "a fixture of its own": """
@pytest.fixture
def made(): work()
def test_it(made): pass
""",
}
FINE = {
    "a fixture of several tests": """
@pytest.fixture(scope="module")
def made(): work()
def test_it(made): pass
""",
    "a fixture of several tests that one of its own asks for": """
@pytest.fixture(scope="module")
def shared(): work()
@pytest.fixture
def made(request): request.getfixturevalue("shared")
def test_it(made): pass
""",
    "what only waits": "def test_it(): time.sleep(0.3)",
    "what is marked": """
@pytest.mark.slow
def test_it(): work()
""",
    "what is watched": """
def test_it():
    sys.setprofile(lambda *_: None)
    work()
    assert sys.getprofile()
""",
    "who is the first to load modules": """
def test_it():
    work()
    sys.modules.update({f"made_{k}": sys for k in range(30)})
""",
    "what is quick": "def test_it(): work(0.01)",
}
Case = Callable[..., pytest.RunResult]


@pytest.fixture
def case(pytester: pytest.Pytester) -> Case:
    """Runs a test of these lines where at most 0.15 s are allowed."""

    def run(code: str, slowness: float = 1.0, load: float = 1.0) -> pytest.RunResult:
        pytester.makeconftest(CONFTEST.format(slowness=slowness, load=load))
        pytester.makeini("[pytest]\nmarkers = slow")
        pytester.makepyfile(WORK + code)
        return pytester.runpytest_inprocess("-p", "no:cacheprovider")

    return run


@pytest.mark.skipif(sys.gettrace() is not None, reason="times mean nothing while lines are counted")
@pytest.mark.parametrize("what", TOO_LONG)
def test_who_takes_too_long_is_told(case: Case, what: str) -> None:
    told = case(TOO_LONG[what])
    told.assert_outcomes(failed=1)
    told.stdout.fnmatch_lines(["it took 0.* s, and 0.1 s are allowed: make it smaller, or mark it slow"])


@pytest.mark.parametrize("what", FINE)
def test_nobody_else_is(case: Case, what: str) -> None:
    case(FINE[what]).assert_outcomes(passed=1)


def test_a_slower_machine_is_allowed_more(case: Case) -> None:
    case(TOO_LONG["the test itself"], slowness=10.0).assert_outcomes(passed=1)


def test_a_machine_with_too_much_to_do_judges_nobody(case: Case) -> None:
    case(TOO_LONG["the test itself"], load=2.0).assert_outcomes(passed=1)


def test_a_test_that_fails_by_itself_tells_its_own_reason(case: Case) -> None:
    told = case("def test_it():\n    work()\n    assert 'own reason' == ''")
    told.assert_outcomes(failed=1)
    assert "own reason" in told.stdout.str()
    assert "are allowed" not in told.stdout.str()


def test_how_slow_the_machine_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limit, "REFERENCE_S", limit.REFERENCE_S / 100)
    assert limit.slowness() > 20
    monkeypatch.setattr(limit, "REFERENCE_S", 1000.0)
    assert limit.slowness() == 1.0


def test_how_much_the_machine_has_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limit.os, "getloadavg", lambda: (6.0, 9.0, 9.0))
    monkeypatch.setattr(limit.os, "cpu_count", lambda: 4)
    assert limit.load() == 1.5
