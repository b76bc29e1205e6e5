"""Two images without any optimisation (the authors' program does this where there is but one pair)."""

import numpy as np

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.align import (
    PNP_CONFIDENCE,
    Start,
    graph_of,
    pose_by_pnp,
    weiszfeld_px,
)
from dreamdrive.geometry.backends.dust3r.pairmaps import PairMaps

_PNP_STEPS = 100


def view_pair(maps: PairMaps, confident: float = PNP_CONFIDENCE) -> Start:
    """Cameras and depth of two images from the more trusted direction of their pair.

    The other camera is posed by PnP of its pixels to its points in the frame of the first. Where that fails,
    its index is in ``unsure`` and its pose the identity. No similarities come back: nothing is brought
    together.

    Args:
        maps: The edges (0, 1) and (1, 0).
        confident: Confidence above which a pixel is used by PnP.

    Raises:
        InputError: Not these two edges, or see ``graph.graph_of``.
    """
    graph_of(maps)
    edge_of = {(int(i), int(j)): edge for edge, (i, j) in enumerate(maps.edges)}
    if set(edge_of) != {(0, 1), (1, 0)} or len(maps.edges) != 2:
        raise InputError(
            f"A single pair is viewed from its edges (0, 1) and (1, 0); got {maps.edges.tolist()}."
        )
    forth, back = edge_of[0, 1], edge_of[1, 0]
    focals = [weiszfeld_px(maps.points[edge][0]) for edge in (forth, back)]
    scores = [float(np.prod([side.mean() for side in maps.confidence[edge]])) for edge in (forth, back)]
    first, edge = (0, forth) if scores[0] > scores[1] else (1, back)
    other = 1 - first
    near, far = maps.points[edge]
    trust = np.maximum(maps.confidence[edge][1], maps.confidence[edge_of[other, first]][0])
    found = pose_by_pnp(far, trust > confident, focals[other], _PNP_STEPS)
    poses = np.tile(np.eye(4), (2, 1, 1))
    if found is not None:
        poses[other] = found[1]
    seen = np.linalg.inv(poses[other]).astype(np.float32)
    depth = [near[..., 2], (far @ seen[:3, :3].T + seen[:3, 3])[..., 2]]
    return Start(
        world_from_camera=poses,
        focals_px=np.array(focals),
        depth=(depth[first], depth[other]),
        pairs=(),
        unsure=() if found is not None else (other,),
    )
