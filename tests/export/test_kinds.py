"""What every export offers."""

from pathlib import Path

import pytest

from dreamdrive.export import EXPORTS, function
from tests.cli.test_commands import driving
from tests.scene.scenes import make_scene


@pytest.mark.parametrize("name", list(EXPORTS))
def test_every_export_says_what_it_does_not_hold(name: str) -> None:
    left_out = EXPORTS.choose(name).left_out
    assert left_out is not None
    said = function(left_out)(driving(make_scene()), Path("made"))
    assert said.endswith(".")
    assert "\n" not in said
