"""The thread that draws."""

import logging
import threading

import pytest

from dreamdrive.view.frames import FrameLoop


@pytest.fixture
def loop():
    made = FrameLoop()
    made.start()
    yield made
    made.close()


def test_only_the_latest_wish_of_each_is_drawn(loop: FrameLoop) -> None:
    busy, go_on, done, drawn = threading.Event(), threading.Event(), threading.Event(), []

    def block() -> None:
        busy.set()
        go_on.wait(10)

    loop.ask("first", block)
    assert busy.wait(10)
    for number in range(50):
        loop.ask("second", lambda number=number: drawn.append(number))
    loop.ask("third", lambda: drawn.append("third"))
    loop.ask("gone", lambda: drawn.append("gone"))
    loop.drop("gone")
    assert loop.asks("second")
    assert not loop.asks("gone")
    loop.ask("last", done.set, after_s=0.05)
    go_on.set()
    assert done.wait(10)
    assert drawn == [49, "third"]


def test_a_wish_in_place_of_a_later_one_is_drawn_at_once(loop: FrameLoop) -> None:
    done, drawn = threading.Event(), []
    loop.ask("one", lambda: drawn.append("resting"), after_s=60)
    loop.ask("one", lambda: (drawn.append("moving"), done.set()))
    assert done.wait(10)
    assert drawn == ["moving"]


def test_what_fails_is_told_and_the_next_one_is_drawn(
    loop: FrameLoop, caplog: pytest.LogCaptureFixture
) -> None:
    done = threading.Event()

    def fail() -> None:
        raise ZeroDivisionError("by mistake")

    with caplog.at_level(logging.ERROR, "dreamdrive"):
        loop.ask("one", fail)
        loop.ask("two", done.set, after_s=0.05)
        assert done.wait(10)
    assert "a picture could not be drawn" in caplog.text
    assert "by mistake" in caplog.text
