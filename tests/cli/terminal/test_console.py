"""Text is printed as it is."""

import pytest

from dreamdrive.cli.terminal.console import plain


@pytest.mark.parametrize("stderr", [False, True])
def test_names_that_look_like_markup_or_emoji_stay(stderr: bool, capsys: pytest.CaptureFixture[str]) -> None:
    name = "cuda:x: [red]street[/red] " + 40 * "a long name "
    plain(stderr=stderr).print(name)
    said = capsys.readouterr()
    assert (said.err if stderr else said.out) == f"{name}\n"
