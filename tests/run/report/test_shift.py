"""Which drive is shown from aside."""

from dataclasses import replace

from dreamdrive.run.report.shift import Shift, shift_of
from dreamdrive.scene.scene import Provenance
from tests.drive.test_aside import FAR, NARROW, standing, street
from tests.run.report.test_judge import GOOD, PHOTO


def test_as_far_as_views_are_trusted_to_the_free_side() -> None:
    wall = street(FAR, standing(2.5, (-2.0, 22.0)))
    words = "shift.mp4 is 2 m to the left: 100% of the way is taken on the other side"
    assert shift_of(wall, GOOD) == Shift(-2, words)
    words = "shift.mp4 is 1 m to the right: nothing is in the way on either side"
    assert shift_of(street(FAR), PHOTO) == Shift(1, words)


def test_nearer_where_only_that_is_free() -> None:
    near = shift_of(street(standing(2.5, (-2.0, 22.0)), standing(-2.5, (-2.0, 22.0))), GOOD)
    words = "neither side is free 2 m away; nearer, nothing is in the way on either side"
    assert near == Shift(1, f"shift.mp4 is 1 m to the right: {words}")
    assert shift_of(street(*NARROW), GOOD).right_m == -2


def test_none_where_views_from_aside_cannot_be_trusted() -> None:
    words = "there is no video from aside, as it could not be trusted"
    assert shift_of(street(FAR), replace(GOOD, fallback="standing")) == Shift(None, words)


def test_without_a_road_nobody_knows_what_is_free() -> None:
    found = shift_of(replace(street(FAR), provenance=Provenance()), GOOD)
    words = "shift.mp4 is 2 m to the right: what is free is not known, as no road was found"
    assert found == Shift(2, words)
