"""The compiled core under arguments that are wrong, memory that ends and threads that cannot start."""

import subprocess
import sys
from pathlib import Path

import pytest

from dreamdrive import _native
from tests.native.calls import CALLS
from tests.native.wrong import stated

ROOT = Path(__file__).parents[2]

RENDER = """
import os, resource, signal, sys, threading
from pathlib import Path
import numpy as np
from dreamdrive import _native as core

signal.alarm(60)
count, size = 60_000, 128

def made():
    rng = np.random.default_rng(0)
    means = rng.normal(size=(count, 3)).astype(np.float32) + np.float32([0, 0, 6])
    quaternions, sh = (rng.normal(size=(count, *tail)).astype(np.float32) for tail in ((4,), (1, 3)))
    scales, opacities = np.full((count, 3), 0.02, np.float32), np.full(count, 0.5, np.float32)
    return core.gaussians(means, quaternions, scales, opacities, sh, None, None, 0)

def rendered(gaussians):
    shapes = (size, size, 3), (size, size), (size, size), (size, size, 0)
    images, seen = [np.zeros(shape, np.float32) for shape in shapes], np.zeros(count, bool)
    pose = np.eye(4, dtype=np.float32)
    frame = core.forward(gaussians, pose, 90, 90, 64, 64, size, size, False, *images, seen, True)
    d_means = np.zeros((count, 3), np.float32)
    core.backward(gaussians, frame, images[0], *[None] * 3, d_means, *[None] * 7, pose)
    return images[0], d_means

def limit(more):
    space = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    most = resource.RLIM_INFINITY if more is None else space + more
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))

def same(one, other):
    return all(np.array_equal(a, b) for a, b in zip(one, other))
"""


limits_addresses = pytest.mark.skipif(
    sys.platform != "linux", reason="limits of addresses are those of Linux"
)


def ran(script: str, *arguments: str) -> str:
    command = [sys.executable, "-c", RENDER + script, *arguments]
    made = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=100, check=False)
    assert made.returncode == 0, f"{made.returncode}: {made.stderr[-2000:]}"
    return made.stdout


def test_each_function_of_the_core_has_a_call() -> None:
    """A function that is new needs one in ``tests/native/calls.py``."""
    functions = {name for name in dir(_native) if callable(getattr(_native, name)) and name[0].islower()}
    assert set(CALLS) == functions
    assert {name: set(made()) for name, made in CALLS.items()} == stated()


def test_no_argument_ends_the_process() -> None:
    command = [sys.executable, "-m", "tests.native.wrong"]
    made = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (made.returncode, made.stdout) == (0, ""), f"{made.stdout}\n{made.stderr}"


ENDS = """
core.set_threads(3)
gaussians = made()
_native_threads = core.all_usable(gaussians)  # begins them
refused = 0
for megabytes in range(0, 60, 2):
    limit(megabytes << 20)
    try:
        rendered(gaussians)
    except MemoryError:
        refused += 1
    limit(None)
assert 0 < refused < 30, refused
after = rendered(gaussians)
core.set_threads(1)
assert same(after, rendered(gaussians))
print("refused")
"""


@limits_addresses
def test_memory_that_ends_is_an_error_and_the_core_goes_on() -> None:
    assert ran(ENDS) == "refused\n"


IN_A_THREAD = """
core.set_threads(2)
nodes = 512
space, lines = [np.ones((3, 64, nodes, nodes), np.float32)], [np.ones((3, 64, nodes), np.float32)]
means, low = np.zeros((9, 3), np.float32), -np.ones(3, np.float32)
planes = core.planes(space, lines, means, low, -low)
out = [np.zeros((3, 64, nodes, nodes), np.float32)], [np.zeros((3, 64, nodes), np.float32)]
limit(30 << 20)
for _ in range(5):
    try:
        core.planes_backward(planes, np.ones((9, 64), np.float32), *out)
    except MemoryError:
        print("refused")
"""


@limits_addresses
def test_memory_that_ends_in_a_thread_of_the_core_is_an_error() -> None:
    assert ran(IN_A_THREAD) == "refused\n" * 5


FEW = """
gaussians = made()
core.set_threads(1)
expected = rendered(gaussians)
core.set_threads(200)
limit(100 << 20)
assert core.all_usable(gaussians)  # begins them
limit(None)
running = len(os.listdir("/proc/self/task"))
assert running < 100, running
assert same(rendered(gaussians), expected)
core.set_threads(2)
assert same(rendered(gaussians), expected)
print("same")
"""


@limits_addresses
def test_threads_that_cannot_start_are_done_without() -> None:
    """A thread takes 8 MB of addresses."""
    assert ran(FEW) == "same\n"


FORKED = """
core.set_threads(2)
gaussians = made()
expected = rendered(gaussians)
stop = []
thread = threading.Thread(target=lambda: [rendered(gaussians) for _ in iter(lambda: bool(stop), True)])
thread.start()
for _ in range(8):
    child = os.fork()
    if not child:
        signal.alarm(20)
        os._exit(0 if same(rendered(gaussians), expected) else 1)
    assert os.waitpid(child, 0)[1] == 0
stop.append(1)
thread.join()
print("same")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="children start over on Linux alone")
def test_a_child_forked_while_another_thread_renders_does_not_wait_for_it() -> None:
    assert ran(FORKED) == "same\n"


CHANGING = """
core.set_threads(1)
gaussians = made()
expected = rendered(gaussians)
stop = []
def change():
    while not stop:
        for count in (1, 5, 2):
            core.set_threads(count)
thread = threading.Thread(target=change)
thread.start()
fine = all(same(rendered(gaussians), expected) for _ in range(20))
stop.append(1)
thread.join()
assert fine
print("same")
"""


def test_another_thread_may_change_the_number_of_threads() -> None:
    assert ran(CHANGING) == "same\n"


def test_weights_that_would_overflow_are_no_cut() -> None:
    for name in ("gain", "right", "below"):
        for extreme in (2**31 - 1, -(2**31)):
            given = CALLS["minimum_cut"]()
            given[name][0, 0] = extreme
            with pytest.raises(ValueError, match="weights of 0 or more below 2\\^30"):
                _native.minimum_cut(**given)


def test_nothing_is_mixed_from_outside_of_the_pictures() -> None:
    for name, column in (("taps", 0), ("taps", 1), ("taps", 2), ("details", 0), ("details", 1)):
        for extreme in (3, -3, 2**31 - 1, -(2**31)):
            given = CALLS["mix"]()
            given[name][0, column] = extreme
            with pytest.raises(ValueError, match=r"no such picture|within the border"):
                _native.mix(**given)
