"""Steps of geometry are counted, and end where they should."""

from dataclasses import replace

import pytest

from dreamdrive.geometry import reconstruct
from dreamdrive.geometry.cameras.mapping import STEPS
from dreamdrive.geometry.dense import LOOK_PASSES, PASSES
from dreamdrive.progress import Work
from dreamdrive.scene.clip import Clip
from dreamdrive.street_network import look
from tests.geometry.toy_drive import make_clip, straight


def steps_of(clip: Clip) -> tuple[list[int], int]:
    """The steps done whenever geometry told of them, and how many there are in all."""
    seen: list[tuple[int, int]] = []
    reconstruct(clip, work=Work(lambda done, total: seen.append((done, total))))
    (total,) = {whole for _, whole in seen}
    return [done for done, _ in seen], total


@pytest.mark.parametrize("looked", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_drive_takes_all_steps(looked: bool) -> None:
    clip = make_clip(straight([0.5] * 7))
    if looked:
        clip = replace(clip, looks=(look(clip.frames),))
    steps, total = steps_of(clip)
    assert total == 8 * (1 + STEPS + PASSES + looked * LOOK_PASSES)
    assert steps == sorted(steps)
    assert steps.count(total) == 1
    assert set(range(8 * (1 + STEPS), total + 1)) <= set(steps)


def test_a_camera_that_stands_jumps() -> None:
    steps, total = steps_of(make_clip(straight([0.0] * 7)))
    assert steps[-1] == total
