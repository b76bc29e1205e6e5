"""The benchmark of queues: its clips and its table."""

import numpy as np

from dreamdrive_bench import queues
from dreamdrive_bench.queues import Row, table, told
from streetworld import DrawnDrive


def test_outlines_tell_of_road_users_and_nothing_of_the_lens(made: DrawnDrive) -> None:
    plain, outlined = told(made, "none", False), told(made, queues.OUTLINES, False)
    assert plain.look is None
    assert outlined.look is not None
    np.testing.assert_array_equal(outlined.look.instances > 0, made.instance > 0)
    assert outlined.rig[0].fx_px == plain.rig[0].fx_px
    calibrated = told(made, queues.OUTLINES, True)
    assert calibrated.rig[0].fx_px == made.cameras[0].fx_px


def test_the_table_counts_what_was_refused_and_what_is_near() -> None:
    rows = [
        Row(0, "none", 0.75, 10.0, None, 0.2, 0.01, -3.0, 5.0),
        Row(1, "none", 0.75, 10.0, None, 0.7, 0.01, -3.0, 5.0),
        Row(2, "none", 0.75, 10.0, "the path jumps", 0.1, 0.01, -3.0, 5.0),
    ]
    text = table(rows)
    assert "none: refused 1 of 3, found within 0.5 % 1, median error 0.20 %" in text
    assert "| 2 | none | 0.75 | 10.0 | 0.10 | 0.010 | -3.0 | 5 | the path jumps |" in text


def test_scenes_have_a_table_of_their_own() -> None:
    scenes = [{"drifts": 1.0, "may drift": 25.0}, {"drifts": 0.0, "may drift": 26.0}]
    rows = [Row(k, "twin", 0.75, 10.0, None, 0.2, 0.01, -3.0, 5.0, scenes[k]) for k in (0, 1)]
    assert "| seed | knowledge | drifts | may drift |" in table(rows)
    assert "| 1 | twin | 0 | 26.00 |" in table(rows)
    assert "| mean |  | 0.5 | 25.50 |" in table(rows)
