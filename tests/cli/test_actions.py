"""Actions as words."""

import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.cli.terminal.arguments import EXAMPLES, parse_action
from dreamdrive.errors import InputError
from dreamdrive.scene.control import Command, Goal, Steering, Waypoints


def test_the_examples_are_actions() -> None:
    assert [parse_action(text) for text in EXAMPLES] == [
        Command("left"),
        Steering(speed_m_s=(8, 8, 8, 8), wheel_rad=(0, 0, 0.1, 0.1)),
        Waypoints(right_m=(0, 0, 0, 1), ahead_m=(4, 8, 12, 16)),
        Goal(column=0.5, row=0.55),
    ]
    assert parse_action("right=0,0,0,1  ahead=4,8,12,16") == parse_action(EXAMPLES[2])


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "no action"),
        ("left", "no action"),
        ("speed=8,8,8,8", "no action"),
        ("command=left goal=0.5,0.5", "no action"),
        ("command=left command=right", "no action"),
        ("command=up", "expected one of left, right, forward, stop"),
        ("goal=0.5", "expected 2 numbers"),
        ("goal=0.5,x", "expected 2 numbers"),
    ],
)
def test_anything_else_is_one_message_with_examples(text: str, problem: str) -> None:
    with pytest.raises(InputError, match=problem) as caught:
        parse_action(text)
    assert "examples are: command=left" in str(caught.value)


@settings(max_examples=100)
@given(st.text(max_size=40) | st.text(alphabet="speedwhl=0123,. -", max_size=40))
def test_rubbish_is_never_a_traceback(text: str) -> None:
    try:
        parse_action(text)
    except InputError as error:
        assert str(error).startswith("--action")  # noqa: PT017
