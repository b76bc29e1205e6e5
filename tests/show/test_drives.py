"""A row for each drive from one photo."""

from dataclasses import replace

import numpy as np

from dreamdrive.show import draw_drives
from tests.scene.scenes import make_scene


def test_each_drive_is_a_row_and_a_rig_on_a_car_is_none() -> None:
    scene = replace(make_scene(), exposure=None)
    count = len(scene.cameras)
    assert draw_drives(scene) is None
    twice = replace(
        scene,
        cameras=(*scene.cameras, *scene.cameras),
        times_s=np.tile(scene.times_s, 2),
        held_out=np.tile(scene.held_out, 2),
        camera=np.repeat([0, 1], count),
    )
    picture = draw_drives(twice)
    assert picture is not None
    height, width = scene.cameras[0].height_px, scene.cameras[0].width_px
    assert picture.shape == (2 * height, 5 * width, 3)
    assert picture.std() > 5
    moved = scene.cameras[0].world_from_camera.copy()
    moved[0, 3] += 1
    mounted = (*scene.cameras, *(scene.cameras[0].at(moved) for _ in scene.cameras))
    assert draw_drives(replace(twice, cameras=mounted)) is None
