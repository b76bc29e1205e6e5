"""True depth, poses and moving cars of a drawn street, as pairs are made from."""

import numpy as np
from tests.geometry.dust3r.align.pairs import Truth

from dreamdrive.data.world import make_street


def street_truth(seed: int, frames: int, fps: float, size: tuple[int, int]) -> Truth:
    """A drive past standing and moving cars."""
    drive = make_street(seed, frames, fps, size)
    movers = [box for box in drive.boxes if box.moving]
    instance = np.zeros(drive.depth_m.shape, int)
    for label, box in enumerate(movers, start=1):
        instance[drive.instance == box.instance] = label
    return Truth(
        depth=drive.depth_m.astype(np.float64),
        world_from_camera=np.stack([camera.world_from_camera for camera in drive.cameras]),
        focal_px=float(drive.cameras[0].fx_px),
        offset_px=0.5,
        instance=instance,
        centres=np.array([box.world_from_box[:, :3, 3] for box in movers]).reshape(-1, frames, 3),
    )
