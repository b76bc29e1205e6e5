"""Samples of one street: as recorded, as rendered beside the path, as warped without a scene."""

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.files.output import new_file
from dreamdrive.tasks.perception import BevSample, BevSet
from dreamdrive_bench.perception.protocol import Places

_ROWS = ("real", "generated-of-real", "warped")
_GAP_PX, _CLEAR_M = 4, 1.0
_GROUND, _ROAD, _VEHICLE = (40, 40, 40), (110, 110, 110), (255, 170, 60)


def picture(path: Path, places: Places, street: int) -> None:
    """Write a row of cameras and labels for each kind of samples; aside are at least a metre."""
    rows: list[UInt8[np.ndarray, "h w 3"]] = []
    for name in _ROWS:
        found = BevSet.open(places.set(name))
        of_street = [k for k, note in enumerate(found.notes) if note.scene == f"street-{street}"]
        aside = [k for k in of_street if abs(found.notes[k].aside_m) >= _CLEAR_M or name == "real"]
        rows.append(_row(found[aside[len(aside) // 2]]))
    gap = np.full((_GAP_PX, rows[0].shape[1], 3), 255, np.uint8)
    sheet = np.concatenate([part for row in rows for part in (row, gap)][:-1])
    with new_file(path) as partial:
        write_picture(partial, sheet[..., ::-1])


def _row(sample: BevSample) -> UInt8[np.ndarray, "h w 3"]:
    """Two rows of three cameras, and the labels at their height."""
    seen = sample.pictures.transpose(0, 2, 3, 1)
    cameras = np.concatenate([np.concatenate(list(three), axis=1) for three in (seen[:3], seen[3:])])
    side = len(cameras)
    labels = np.empty((*sample.labels.road().shape, 3), np.uint8)
    labels[:] = _GROUND
    labels[sample.labels.road() > 0] = _ROAD
    labels[sample.labels.vehicle() > 0] = _VEHICLE
    larger = cv2.resize(labels, (side, side), interpolation=cv2.INTER_NEAREST)
    return np.concatenate([cameras, np.full((side, _GAP_PX, 3), 255, np.uint8), larger], axis=1)
