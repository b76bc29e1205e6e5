"""The level frame of a scene."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.scene.level import level_from_world
from tests.scene.scenes import make_scene


def test_the_road_is_at_zero_below_the_first_camera() -> None:
    scene = make_scene()
    scene = replace(scene, provenance=replace(scene.provenance, camera_height_m=1.5))
    level = level_from_world(scene)
    np.testing.assert_allclose(level @ [0, 0, 0, 1], [0, 0, 1.5, 1])
    np.testing.assert_allclose(level @ [2, 1.5, 7, 1], [7, -2, 0, 1], atol=1e-12)


def test_a_camera_that_looks_up_has_nothing_ahead() -> None:
    scene = make_scene()
    about = replace(scene.provenance, camera_height_m=1.5, up=(0.0, 0.0, 1.0))
    with pytest.raises(InputError, match="looks straight up or down"):
        level_from_world(replace(scene, provenance=about))
