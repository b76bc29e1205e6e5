"""How signals stop work."""

import os
import signal

import pytest

from dreamdrive.cli.terminal.machine import Terminated, asked_to_stop


@pytest.mark.parametrize(
    ("number", "ends"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)]
)
def test_the_first_signal_asks_and_the_second_ends(number: int, ends: type[BaseException]) -> None:
    before = signal.getsignal(number)
    with asked_to_stop() as stop:
        assert not stop()
        os.kill(os.getpid(), number)
        assert stop()
        with pytest.raises(ends):
            os.kill(os.getpid(), number)
        with pytest.raises(ends):
            stop.end()
    assert signal.getsignal(number) is before
