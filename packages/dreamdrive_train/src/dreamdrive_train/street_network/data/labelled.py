"""Pictures outlined by hand: from a file of outlines to records.

A file of outlines is JSON, one a source: ``LabelFile``. Outlines are painted in order, later ones over
earlier ones. A hand draws the border of a wood or a lawn several pixels off and that of a car one pixel off,
so a band along each border is left unknown.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import cv2
import msgspec
import numpy as np
from jaxtyping import Bool, Float, UInt8
from msgspec import Meta

from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.scene.street.street_class import ROAD_USERS, StreetClass
from dreamdrive_train.street_network.data.records import UNKNOWN, Record, depth_steps

ROAD_OR_MARKING = 32
FLOOR = 33
ROAD_USER = 34
ROADSIDE = 35
OFF_ROAD = 36
CLASSES = {c.name.lower(): int(c) for c in StreetClass} | {
    "floor": FLOOR,
    "roadside": ROADSIDE,
    "void": UNKNOWN,
}
"""The names of classes in a file. ``floor`` is road, marking or other ground, ``roadside`` is structure,
vegetation or pole; ``void`` is not known."""
MASK_COLOURS = {
    (0x40, 0x20, 0x20): int(StreetClass.ROAD),
    (0xFF, 0x00, 0x00): int(StreetClass.MARKING),
    (0x80, 0x80, 0x60): OFF_ROAD,
    (0x00, 0xFF, 0x66): ROAD_USER,
    (0xCC, 0x00, 0xFF): int(StreetClass.OWN_CAR),
}
"""Colours of comma10k's masks."""

UNDERFOOT = (StreetClass.ROAD, StreetClass.MARKING, StreetClass.GROUND, FLOOR)
"""What road users stand on."""

Point = tuple[float, float]


class Outline(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A closed outline, in pixels of the picture. ``foot`` is the line where the thing touches the ground."""

    name: str = msgspec.field(name="class")
    points: Annotated[list[Point], Meta(min_length=3)]
    foot: Annotated[list[Point], Meta(min_length=2)] | None = None

    def __post_init__(self) -> None:
        if self.name not in CLASSES:
            raise ValueError(f"an outline's class is {self.name!r}; known are {', '.join(CLASSES)}")


class LabelledPicture(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A picture and its outlines.

    ``size`` is width and height in pixels. ``horizon`` holds the rows at which the line of eye level crosses
    the left and the right border. ``flat`` is false where the road rises or falls. ``focal_px`` is the focal
    length where it is known. ``group`` is the recording it belongs to, by default the picture itself.
    ``mask`` is a picture of comma10k's classes, of which outlines of road users only cut instances.
    """

    image: str
    size: tuple[int, int]
    horizon: tuple[float, float] | None
    lens: Literal["plain", "wide", "fisheye"]
    shapes: list[Outline]
    flat: bool = True
    focal_px: Annotated[float, Meta(gt=0)] | None = None
    group: str | None = None
    mask: str | None = None


class LabelFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All outlined pictures of a source."""

    source: str
    licence: str
    pictures: list[LabelledPicture]


@dataclass(frozen=True)
class LabelledOptions:
    """How outlines become labels."""

    long_side_px: int = 512
    """Larger pictures are reduced to this: twice what the network sees, so that crops stay sharp."""
    region_band_px: int = 3
    """Left unknown on either side of a border between regions, which are drawn with few corners."""
    marking_contrast: float = 14.0
    """Road brighter than what surrounds it by so many of 255 levels may be a marking nobody outlined."""
    marking_width_px: int = 17
    """Brighter things on the road are wider than a marking from here."""
    least_drop: float = 0.02
    """Rows nearer below the horizon than this share of the height have no depth: too uncertain."""
    median_depth_m: float = 10.0
    """The median of a picture's depth; its true scale is not known."""
    keep_out_every: int = 8
    """One group of so many, by name, is kept out of training."""


def labelled_records(
    labels: Path, data_dir: Path, out_dir: Path, options: LabelledOptions = LabelledOptions()
) -> list[Record]:
    """Write pictures, labels and depth of a file of outlines to ``out_dir``; their records.

    The names of pictures in the file are relative to ``data_dir``.
    """
    file = msgspec.json.decode(labels.read_bytes(), type=LabelFile)
    groups = sorted({picture.group or picture.image for picture in file.pictures})
    kept_out = set(groups[options.keep_out_every - 1 :: options.keep_out_every])
    out_dir.mkdir(parents=True, exist_ok=True)
    return [
        _write(picture, file.source, (picture.group or picture.image) in kept_out, data_dir, out_dir, options)
        for picture in file.pictures
    ]


def _write(
    picture: LabelledPicture,
    source: str,
    kept_out: bool,
    data_dir: Path,
    out_dir: Path,
    options: LabelledOptions,
) -> Record:
    image = _read(data_dir / picture.image)
    height, width = image.shape[:2]
    if (width, height) != picture.size:
        raise ValueError(f"{picture.image} is {width}x{height}, its outlines are for {picture.size}")
    scale = min(1.0, options.long_side_px / max(width, height))
    size = (round(width * scale), round(height * scale))
    image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    mask = None if picture.mask is None else _mask_labels(_read(data_dir / picture.mask), size)
    painted, instances = _paint(picture.shapes, scale, size, mask)
    unknown = _bands(painted, instances, options) if mask is None else painted == UNKNOWN
    depth_m = None
    if picture.horizon is not None and picture.flat and picture.lens == "plain":
        depth_m = _depth(picture, painted, instances, unknown, options)
    instances = np.where(unknown | ((painted == ROAD_USER) & (instances == 0)), UNKNOWN, instances)
    shown = np.where(unknown, UNKNOWN, painted)
    if mask is None:
        shown = np.where((shown == StreetClass.ROAD) & _bright(image, options), ROAD_OR_MARKING, shown)

    stem = picture.image.removesuffix(Path(picture.image).suffix).replace("/", "_")
    names = f"{stem}.jpg", f"{stem}_labels.png", f"{stem}_depth.png"
    encoded = np.stack([np.zeros_like(shown), instances, shown], axis=-1).astype(np.uint8)
    write_picture(out_dir / names[0], image, quality=92)
    write_picture(out_dir / names[1], encoded)
    if depth_m is not None:
        write_picture(out_dir / names[2], depth_steps(depth_m))
    horizon_px, roll_rad = None, None
    if picture.horizon is not None:
        left, right = picture.horizon
        horizon_px = ((left + right) / 2 - height / 2) * scale
        roll_rad = float(np.arctan2(left - right, width))
    return Record(
        image=names[0],
        source=source,
        group=picture.group or picture.image,
        labels=names[1],
        depth=None if depth_m is None else names[2],
        focal_px=None if picture.focal_px is None else picture.focal_px * scale,
        horizon_px=horizon_px,
        roll_rad=roll_rad,
        distorted=picture.lens != "plain",
        kept_out=kept_out,
    )


def _read(path: Path) -> UInt8[np.ndarray, "h w 3"]:
    image = cv2.imread(str(path))
    if image is None:
        raise ValueError(f"{path} is no picture that can be read")
    return image


def _mask_labels(mask: UInt8[np.ndarray, "h w 3"], size: tuple[int, int]) -> UInt8[np.ndarray, "y x"]:
    """Labels of a mask in BGR; a colour that is not listed is unknown."""
    mask = cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST)
    labels = np.full(mask.shape[:2], UNKNOWN, dtype=np.uint8)
    for colour, label in MASK_COLOURS.items():
        labels[(mask[..., ::-1] == colour).all(axis=-1)] = label
    return labels


def _paint(
    shapes: list[Outline], scale: float, size: tuple[int, int], mask: UInt8[np.ndarray, "y x"] | None
) -> tuple[UInt8[np.ndarray, "y x"], UInt8[np.ndarray, "y x"]]:
    """Labels and instances; instance n is the n-th road user of the shapes."""
    width, height = size
    labels = np.full((height, width), UNKNOWN, dtype=np.uint8) if mask is None else mask.copy()
    instances = np.zeros_like(labels)
    road_users = 0
    for shape in shapes:
        label = CLASSES[shape.name]
        inside = np.zeros_like(labels)
        cv2.fillPoly(inside, [_scaled(shape.points, scale)], 1)
        inside = inside > 0
        if label in ROAD_USERS:
            road_users += 1
            if road_users >= UNKNOWN:
                raise ValueError(f"a picture may hold {UNKNOWN - 1} road users, not more")
            if mask is not None:
                inside &= mask == ROAD_USER
        labels[inside] = label
        instances[inside] = road_users if label in ROAD_USERS else 0
    return labels, instances


def _scaled(points: list[Point], scale: float) -> np.ndarray:
    """Points, whose pixel centres are at whole numbers, on the reduced picture, rounded."""
    return np.rint((np.array(points) + 0.5) * scale - 0.5).astype(np.int32)


def _bands(
    labels: UInt8[np.ndarray, "y x"], instances: UInt8[np.ndarray, "y x"], options: LabelledOptions
) -> Bool[np.ndarray, "y x"]:
    """What is not known, or too near a border to be sure.

    A band between regions is wide. One at a road user is one pixel on either side. Markings and poles are
    too thin to lose any.
    """
    fine = np.isin(labels, [*ROAD_USERS, StreetClass.MARKING, StreetClass.POLE])
    narrow, wide = np.zeros_like(fine), np.zeros_like(fine)
    for axis in (0, 1):
        a, b = ((slice(None),) * axis + (s,) for s in (slice(None, -1), slice(1, None)))
        border = (labels[a] != labels[b]) | (instances[a] != instances[b])
        border &= (labels[a] != UNKNOWN) & (labels[b] != UNKNOWN)
        at_fine = fine[a] | fine[b]
        for side in (a, b):
            narrow[side] |= border & at_fine
            wide[side] |= border & ~at_fine
    across = 2 * options.region_band_px - 1
    wide = cv2.dilate(wide.astype(np.uint8), np.ones((across, across), np.uint8)) > 0
    thin = np.isin(labels, [StreetClass.MARKING, StreetClass.POLE])
    return (labels == UNKNOWN) | (narrow & ~thin) | (wide & ~fine)


def _bright(image: UInt8[np.ndarray, "y x 3"], options: LabelledOptions) -> Bool[np.ndarray, "y x"]:
    """Thin things brighter than what surrounds them."""
    grey = cv2.medianBlur(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), 3)
    across = options.marking_width_px
    top_hat = cv2.morphologyEx(grey, cv2.MORPH_TOPHAT, np.ones((across, across), np.uint8))
    return cv2.dilate((top_hat > options.marking_contrast).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0


def _depth(
    picture: LabelledPicture,
    labels: UInt8[np.ndarray, "y x"],
    instances: UInt8[np.ndarray, "y x"],
    unknown: Bool[np.ndarray, "y x"],
    options: LabelledOptions,
) -> Float[np.ndarray, "y x"] | None:
    """Depth of the flat road, and of what stands on it, up to one factor; 0 where unknown.

    A point of the ground lies as far as the inverse of its drop below the horizon. Of a vehicle the lower
    half has the depth of its contact with the ground; what is above may be set back. None where no road is
    seen.
    """
    height = labels.shape[0]
    drop = _drop(picture, labels.shape, options)
    far = 1.0 / np.maximum(drop, 1e-9)
    road = np.isin(labels, [StreetClass.ROAD, StreetClass.MARKING]) & (drop > 0)
    if not road.any():
        return None
    depth = np.where(road, far, 0.0)
    road_users = [shape for shape in picture.shapes if CLASSES[shape.name] in ROAD_USERS]
    for number, shape in enumerate(road_users, start=1):
        rows, columns = np.nonzero(instances == number)
        if not len(rows):
            continue
        bottom = rows.max()
        if shape.foot is not None:
            foot = np.array(sorted(shape.foot)) * (height / picture.size[1])
            contact_rows = np.interp(columns, foot[:, 0], foot[:, 1]).round().astype(int)
        elif bottom + 1 < height and labels[bottom + 1, columns[rows == bottom][0]] in UNDERFOOT:
            contact_rows = np.full(len(rows), bottom)
        else:
            continue
        contact_rows = np.minimum(contact_rows, height - 1)
        low = (rows > (rows.min() + bottom) / 2) & (drop[contact_rows, columns] > 0)
        depth[rows[low], columns[low]] = far[contact_rows[low], columns[low]]
    return np.where(unknown, 0.0, depth * (options.median_depth_m / np.median(depth[road])))


def _drop(
    picture: LabelledPicture, shape: tuple[int, int], options: LabelledOptions
) -> Float[np.ndarray, "y x"]:
    """How far pixels lie below the horizon, as a share of the height; 0 if too near."""
    assert picture.horizon is not None
    left, right = picture.horizon
    (height, width), (full_width, full_height) = shape, picture.size
    at = (np.arange(width) + 0.5) / width
    horizon = (left + (right - left) * at) / full_height * height
    slope = (right - left) / full_width
    drop = (np.arange(height)[:, None] - horizon) / height / np.hypot(1.0, slope)
    return np.where(drop >= options.least_drop, drop, 0.0)
