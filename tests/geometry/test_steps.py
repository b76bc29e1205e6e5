"""Steps of geometry are counted, and end where they should."""

from tests.geometry.toy_drive import make_clip, straight

from dreamdrive.geometry import reconstruct
from dreamdrive.geometry.cameras.mapping import STEPS
from dreamdrive.geometry.dense import PASSES
from dreamdrive.progress import Work


def test_a_drive_takes_all_steps_and_one_that_stands_jumps() -> None:
    seen: list[tuple[int, int]] = []
    reconstruct(make_clip(straight([0.5] * 7)), work=Work(lambda done, total: seen.append((done, total))))
    total = 8 * (1 + STEPS + PASSES)
    assert {whole for _, whole in seen} == {total}
    steps = [done for done, _ in seen]
    assert steps == sorted(steps)
    assert steps.count(total) == 1
    assert set(range(8 * (1 + STEPS), total + 1)) <= set(steps)
    seen.clear()
    reconstruct(make_clip(straight([0.0] * 7)), work=Work(lambda done, total: seen.append((done, total))))
    assert seen[-1] == (total, total)
