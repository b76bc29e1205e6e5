"""A photo becomes a drive, with nothing downloaded: its street in layers, drawn along the path."""

from dreamdrive.prior.photo.layers import Layers, layers_of
from dreamdrive.prior.photo.make import make_clip, seen_in, view
from dreamdrive.prior.photo.street import Street
from dreamdrive.prior.protocol import Prior

PHOTO = Prior(
    name="photo",
    make=make_clip,
    takes=frozenset(
        {
            "path",
            "frames",
            "size",
            "hfov_deg",
            "view",
            "intrinsics",
            "hold_out",
            "action",
            "actions",
            "trajectory",
            "trajectories",
            "camera_height_m",
            "knowledge",
            "traffic",
            "traffic_speed_m_s",
            "fill",
        }
    ),
    gives="25 frames at 10 Hz with the poses, depth and sky that they were drawn from",
    about="a photo becomes a street in layers, by the street network, and is driven into",
    licence="Apache-2.0, as all of dreamdrive",
    memory="0.6 GB for 25 frames at 480x270",
)
