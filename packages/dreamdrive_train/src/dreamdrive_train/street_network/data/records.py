"""Pictures with what is known of them, as files: what the training reads, whoever wrote it.

A folder of records has ``records.jsonl``, one record a line, beside its pictures:

- the picture, an 8-bit RGB JPEG or PNG;
- ``labels``, an 8-bit RGB PNG of the same size: red is a label (``LABEL_SETS``), green the instance of a road
  user from 1 (0: none, 255: not known), blue is 0;
- ``depth``, a 16-bit PNG of the same size, whose entries are 256 times the depth along z in metres: 0 is
  unknown, 65535 means that far or farther. Sky has no depth.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from dreamdrive.files.output import new_file
from dreamdrive.scene.street.street_class import StreetClass

UNKNOWN = 255
LABEL_SETS: dict[int, frozenset[StreetClass]] = {
    **{int(c): frozenset({c}) for c in StreetClass},
    32: frozenset({StreetClass.ROAD, StreetClass.MARKING}),
    33: frozenset({StreetClass.ROAD, StreetClass.MARKING, StreetClass.GROUND}),
    34: frozenset({StreetClass.VEHICLE, StreetClass.TWO_WHEELER, StreetClass.PERSON}),
    35: frozenset({StreetClass.STRUCTURE, StreetClass.VEGETATION, StreetClass.POLE}),
    36: frozenset(
        {
            StreetClass.SKY,
            StreetClass.GROUND,
            StreetClass.STRUCTURE,
            StreetClass.VEGETATION,
            StreetClass.POLE,
        }
    ),
    37: frozenset(set(StreetClass) - {StreetClass.VEHICLE, StreetClass.TWO_WHEELER, StreetClass.PERSON}),
}
"""What a label says: the pixel is one of these classes. Any other number says nothing."""
DEPTH_STEPS = 256.0
FAR = 65535


# Beyond these sums overflow, or a picture is never drawn.
_Weight = Annotated[float, Meta(ge=1e-6, le=1e6)]
_Length = Annotated[float, Meta(gt=0, le=1e7)]
_Number = Annotated[float, Meta(ge=-1e7, le=1e7)]


class Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A picture and what is known of it; None is unknown.

    ``source`` names where it comes from, ``group`` the recording or street it belongs to: what is judged must
    share no group with what is trained on. ``weight`` is how often it is drawn against others of its source.
    ``horizon_px`` is the row at which level rays cross the middle column, counted downwards from the middle
    of the picture; ``roll_rad`` is how far the camera is turned clockwise, seen from behind it; the camera
    height is that above the road. Depth is in metres where ``camera_height_m`` is given or ``metric`` is
    true, else up to one factor a picture.
    """

    image: str
    source: str
    group: str
    labels: str | None = None
    depth: str | None = None
    focal_px: _Length | None = None
    horizon_px: _Number | None = None
    roll_rad: _Number | None = None
    camera_height_m: _Length | None = None
    distorted: bool | None = None
    metric: bool = False
    kept_out: bool = False
    weight: _Weight = 1.0


def write_records(records: list[Record], folder: Path) -> None:
    """Write ``records.jsonl``; the pictures are there already."""
    lines = [msgspec.json.encode(record) for record in records]
    with new_file(folder / "records.jsonl") as partial:
        partial.write_bytes(b"\n".join(lines) + b"\n")


def read_records(folder: Path) -> Iterator[Record]:
    """The records of a folder."""
    for line in (folder / "records.jsonl").read_bytes().splitlines():
        yield msgspec.json.decode(line, type=Record)


def depth_steps(depth_m: np.ndarray) -> np.ndarray:
    """Depth in metres, 0 where unknown, as the 16-bit numbers of a depth picture."""
    steps = np.rint(np.asarray(depth_m, np.float64) * DEPTH_STEPS)  # half precision would overflow
    return np.where(depth_m > 0, np.clip(steps, 1, FAR), 0).astype(np.uint16)
