"""Frames of the two recorded motorways, with cameras that the whole clip tells: no others are known."""

from collections.abc import Iterator

import numpy as np

from dreamdrive.data.clip_reader import read_clip
from dreamdrive.errors import InputError
from dreamdrive.geometry import reconstruct
from dreamdrive.street_network import look_at, with_looks
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.common.twin import TWIN
from dreamdrive_bench.photo.cases import AHEAD_S, SIZE, Case
from dreamdrive_bench.photo.ways import Sight, Start

_CLIPS = {"open": "udacity_highway_open", "cars": "udacity_highway_two_cars"}
_EVERY_S = 1.0
"""From one start to the next."""


def highways() -> Iterator[Case]:
    """Each second of each, as long as two seconds are left."""
    for short, name in _CLIPS.items():
        folder = DATA / "clips" / name
        clip = read_clip(folder / "video.mp4", frames="::2", size=SIZE, intrinsics=folder / "meta.json")
        clip = with_looks(clip, look_at(clip, TWIN))
        geometry = reconstruct(clip)
        ground = geometry.ground
        if ground is None:
            raise InputError(f"{name}: no road was found in it")
        poses = np.stack([camera.world_from_camera for camera in geometry.cameras])
        rate_hz = 1 / float(np.diff(clip.times_s).mean())
        for first in range(0, len(poses) - round(AHEAD_S[-1] * rate_hz), round(_EVERY_S * rate_hz)):
            sights: list[Sight] = []
            for after_s in AHEAD_S:
                then = first + round(after_s * rate_hz)
                pose, t_s = (
                    np.linalg.inv(poses[first]) @ poses[then],
                    clip.times_s[then] - clip.times_s[first],
                )
                sights.append(Sight(f"{after_s:g} s", t_s, pose, clip.frames[then]))
            height_m = float(ground.height_m(poses[first][:3, 3]))
            camera = geometry.cameras[first].at(np.eye(4))
            yield Case(f"motorway {short} {first}", Start(clip.frames[first], camera, height_m, True), sights)
