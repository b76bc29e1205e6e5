"""What a network without mistakes would see."""

import numpy as np

from dreamdrive.scene.street.street_class import ROAD_USERS, StreetClass
from dreamdrive_bench.common.true_look import true_look
from streetworld import DrawnDrive, make_street


def test_outlines_classes_and_depth_are_those_of_the_street(made: DrawnDrive) -> None:
    look = true_look(made)
    assert look.camera.focal_px == made.cameras[0].fx_px
    assert true_look(made, 70.0).camera.focal_px == 70.0
    np.testing.assert_array_equal(look.instances > 0, made.instance > 0)
    assert np.isin(look.classes[look.instances > 0], ROAD_USERS).all()
    np.testing.assert_array_equal(look.sky, made.sky)
    seen = look.depth > 0
    np.testing.assert_allclose(look.depth[seen] * 1.5, made.depth_m[seen], rtol=0.01)
    for frame, users in enumerate(look.road_users):
        assert users
        for number, user in enumerate(users, 1):
            there = look.instances[frame] == number
            left, top, right, bottom = user.box_px
            assert user.pixels == there.sum() == there[top:bottom, left:right].sum()
            assert user.kind in ROAD_USERS
            assert len(np.unique(made.instance[frame][there])) == 1


def test_nobody_is_outlined_where_nobody_is() -> None:
    look = true_look(make_street(0, 2, size=(48, 28), movers=0, parked=0))
    assert look.road_users == ((), ())
    assert not look.instances.any()
    assert (look.classes != StreetClass.VEHICLE).all()
