"""How far beside the recorded path a scene can be looked at."""

from collections.abc import Callable, Sequence

import numpy as np

from dreamdrive.trust.trust import SceneTrust

FALL_DB = 3.0
"""Expected PSNR this much below that of the recorded path is no longer good."""
SHIFTS_M = (0.125, 0.25, 0.375, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
_PLACES = 4


def reach_m(expected_db: Callable[[float], float], side: int) -> float:
    """The first distance aside at which a drive is ``FALL_DB`` worse than the recorded one, in metres.

    The mean over some of the recorded views, evenly between the distances tried; at most the last of them.

    Args:
        expected_db: PSNR to expect so many metres to the right, as ``expected_db`` tells of a scene.
        side: 1 for to the right, -1 for to the left.
    """
    told: list[float] = []
    for metres in (0.0, *SHIFTS_M):
        told.append(expected_db(side * metres))
        if told[-1] < told[0] - FALL_DB:
            break
    return fall_m((0.0, *SHIFTS_M), told) or SHIFTS_M[-1]


def fall_m(metres: Sequence[float], psnr_db: Sequence[float]) -> float | None:
    """Where PSNR first is ``FALL_DB`` below its first value, evenly between two distances; None: nowhere."""
    low = psnr_db[0] - FALL_DB
    for k in range(1, len(psnr_db)):
        if psnr_db[k] < low:
            share = (psnr_db[k - 1] - low) / (psnr_db[k - 1] - psnr_db[k])
            return metres[k - 1] + share * (metres[k] - metres[k - 1])
    return None


def expected_db(trust: SceneTrust, right_m: float) -> float:
    """PSNR to expect so far to the right of the recorded path, the mean over some of its views."""
    scene, front = trust.scene, trust.scene.front
    views = front[np.linspace(0, len(front) - 1, _PLACES + 2).round().astype(int)[1:-1]].tolist()
    seen = [trust.view(scene.cameras[view].moved(right_m), float(scene.times_s[view])) for view in views]
    return float(np.mean([each.psnr_db for each in seen]))
