"""What a fit may see of a frame."""

from dataclasses import replace

import cv2
import numpy as np
import torch

from dreamdrive.fit.views import training_views
from tests.streets import small_street, street_clip, true_geometry


def test_what_stands_keeps_away_from_what_moves() -> None:
    street = small_street(size=(96, 64), frames=4)
    clip, geometry = street_clip(street), true_geometry(street)
    moving = np.zeros_like(geometry.moving)
    moving[:, 20:30, 40:60] = 1
    views = training_views(clip, replace(geometry, moving=moving))
    for view in views:
        still = view.still.numpy()
        assert not still[20:30, 40:60].any()
        assert not still[19, 40:60].any()
        assert still[:15].all()
        # Only the rim is left out of what stands.
        grown = cv2.dilate(moving[view.index], np.ones((9, 9))) > 0
        assert (still | grown).all()


def test_nothing_is_known_to_stand_where_no_motion_was_seen() -> None:
    street = small_street(size=(96, 64), frames=4)
    clip, geometry = street_clip(street), true_geometry(street)
    views = training_views(clip, replace(geometry, moving=np.zeros_like(geometry.moving)))
    assert not torch.stack([view.still for view in views]).any()
