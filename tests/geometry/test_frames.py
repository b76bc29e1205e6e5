from dataclasses import replace

import numpy as np
import pytest
from tests.geometry.toy_drive import make_clip, straight

from dreamdrive.errors import InputError
from dreamdrive.geometry.frames import check_frames


def test_a_drive_is_accepted_and_a_still_is_not() -> None:
    clip = make_clip(straight([0.5, 0.5]))
    check_frames(clip, "dust3r")
    with pytest.raises(InputError, match="dust3r: all 3 frames are alike"):
        check_frames(replace(clip, frames=np.repeat(clip.frames[:1], 3, axis=0)), "dust3r")
