"""Samples on disk: pictures of cameras, labels of the cells around the car, and a list of what they are of.

- ``manifest.json``: sizes, cameras, and of each sample what it is of, its poses and its cameras.
- ``pictures/ID/CAMERA.jpg`` (or ``.png``): as the network takes them.
- ``labels/ID.png``: bit i of 16 is layer i of ``LAYERS``; ``labels/ID_visibility.png``.
- ``labels/ID.npz``: the auxiliary maps, of cells that have any.
"""

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from jaxtyping import Float, UInt8
from msgspec import Meta
from msgspec.structs import asdict

from dreamdrive.data.array_file import read_npz
from dreamdrive.data.formats.rigid import JsonPose
from dreamdrive.data.pictures.images import read_image
from dreamdrive.data.pictures.picture_file import read_picture, write_picture
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type, read_json
from dreamdrive.files.kinds import SAMPLES_KIND
from dreamdrive.files.output import new_folder, plain_name
from dreamdrive.files.paths import inside
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.camera import FARTHEST_M, check_rigid
from dreamdrive.tasks.perception.grid import BevGrid
from dreamdrive.tasks.perception.network.inputs import BevSample
from dreamdrive.tasks.perception.options import ImageSize
from dreamdrive.tasks.perception.raster import LAYERS, BevLabels

MANIFEST = "manifest.json"
PictureFormat = Literal["jpg", "png"]
_JPEG = 95
_Number = Annotated[float, Meta(ge=-FARTHEST_M, le=FARTHEST_M)]
_Row3 = tuple[_Number, _Number, _Number]
_LEAST_AREA = 1e-3
"""Of the pixels in which a camera shows one radian across and one down; with less it has no focal length."""


class SampleCamera(msgspec.Struct):
    """A camera of a sample: intrinsics in pixels of its picture, extrinsics from the level ego frame."""

    name: str
    pixel_from_camera: tuple[_Row3, _Row3, _Row3]
    camera_from_ego: JsonPose


class SampleNote(msgspec.Struct):
    """What a sample is of.

    Attributes:
        id: Name of its files.
        scene: Name of the drive.
        time_s: On the clock of the drive.
        kind: ``recorded`` pictures, or ``rendered`` ones of a scene.
        aside_m: How far to the left of the recorded path the car is.
        turned_rad: How far to the left of the recorded direction it looks.
        world_from_ego: Where it is, in the world of the drive.
        covered: Share of the pictures that the scene covers; 1 for recorded ones.
        boxes: How many are in the labels.
        cameras: In the order of the pictures.
        prior: Name of the prior that drew or generated the frames of the scene; None of recorded ones.
    """

    id: Annotated[str, Meta(min_length=1, max_length=100)]
    scene: str
    time_s: float
    kind: Literal["recorded", "rendered"]
    aside_m: float
    turned_rad: float
    world_from_ego: JsonPose
    covered: float
    boxes: int
    cameras: Annotated[list[SampleCamera], Meta(min_length=1, max_length=100)]
    prior: str | None = None


class _Image(msgspec.Struct):
    height_px: int
    width_px: int
    cropped_px: int


class _Grid(msgspec.Struct):
    rows: int
    columns: int
    length_m: float
    width_m: float


class _Manifest(msgspec.Struct):
    image: _Image
    grid: _Grid
    suffix: PictureFormat
    samples: list[SampleNote]
    left_out: dict[str, int] = {}
    format: Literal[1] = 1


@dataclass(frozen=True)
class BevSet:
    """Samples of one size on disk; each is read when it is asked for."""

    folder: Path
    image: ImageSize
    grid: BevGrid
    suffix: str
    notes: tuple[SampleNote, ...]

    @staticmethod
    def open(folder: Path) -> "BevSet":
        """A set by its folder."""
        where = folder / MANIFEST
        if not where.is_file():
            raise InputError(
                f"{folder} is no set of samples: {MANIFEST} is missing; see dreamdrive dataset make"
            )
        found = of_type(read_json(where, follow=False), _Manifest, str(where))
        for note in found.samples:
            _check_places(note, str(where))
        try:
            image, grid = ImageSize(**asdict(found.image)), BevGrid(**asdict(found.grid))
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        return BevSet(folder, image, grid, found.suffix, tuple(found.samples))

    def __len__(self) -> int:
        return len(self.notes)

    def digest(self) -> str:
        """SHA-256 of the manifest, which tells sets apart."""
        return hashlib.sha256((self.folder / MANIFEST).read_bytes()).hexdigest()

    def __getitem__(self, index: int) -> BevSample:
        """A sample with its pictures and labels."""
        note = self.notes[index]
        names = [f"pictures/{plain_name(note.id)}/{plain_name(each.name)}" for each in note.cameras]
        pictures = [read_image(inside(self.folder, f"{name}.{self.suffix}")).rgb for name in names]
        size = self.image.height_px, self.image.width_px
        for camera, picture in zip(note.cameras, pictures, strict=True):
            if picture.shape[:2] != size:
                raise InputError(
                    f"{self.folder}: picture {camera.name} of {note.id} is {picture.shape[1]}x"
                    f"{picture.shape[0]}; expected {size[1]}x{size[0]} as in {MANIFEST}"
                )
        return BevSample(
            pictures=np.stack(pictures).transpose(0, 3, 1, 2),
            pixel_from_camera=np.array([each.pixel_from_camera for each in note.cameras], np.float32),
            camera_from_ego=np.array([each.camera_from_ego for each in note.cameras], np.float32),
            labels=self._labels(plain_name(note.id)),
        )

    def _labels(self, name: str) -> BevLabels:
        bits = read_picture(inside(self.folder, f"labels/{name}.png"))
        visibility = read_picture(inside(self.folder, f"labels/{name}_visibility.png"))
        size = self.grid.rows, self.grid.columns
        if bits.shape != size or visibility.shape != size or bits.dtype != np.uint16:
            raise InputError(f"{self.folder}: labels of {name} are no 16-bit picture of {size[1]}x{size[0]}")
        place = inside(self.folder, f"labels/{name}.npz")
        stored = read_npz(place, ("cells", "values"))
        auxiliary = np.zeros((*size, 8), np.float32)
        cells, values = (stored.get(each, np.zeros(0)) for each in ("cells", "values"))
        fits = cells.ndim == 1 and cells.dtype.kind in "iu" and values.shape == (len(cells), 8)
        if (
            not fits
            or not ((cells >= 0) & (cells < size[0] * size[1])).all()
            or not np.isfinite(values).all()
        ):
            raise InputError(f"{place} holds no maps of {size[1]}x{size[0]} cells")
        auxiliary.reshape(-1, 8)[cells] = values
        layers = (bits[None] >> np.arange(len(LAYERS))[:, None, None]) & 1
        return BevLabels(layers.astype(np.uint8), visibility.astype(np.uint8), auxiliary)


def write_bev_set(
    samples: Iterable[tuple[SampleNote, BevSample]],
    folder: Path,
    image: ImageSize,
    grid: BevGrid,
    *,
    count: int,
    suffix: PictureFormat = "jpg",
    left_out: dict[str, int] | None = None,
    replace: bool = False,
    progress: Progress = silent,
) -> None:
    """Write samples as they come; the folder appears whole or not at all.

    Args:
        samples: With what they are of; names that stand twice raise ``ValueError``.
        folder: To write.
        image: Size of the pictures.
        grid: Cells of the labels.
        count: About how many there are, for whoever waits.
        suffix: ``jpg`` loses a little, ``png`` nothing.
        left_out: Why others are not among them, and how many; read when all are written.
        replace: Take the place of an older set.
        progress: Told of samples done.
    """
    notes: list[SampleNote] = []
    with new_folder(folder, replace=replace, kind=SAMPLES_KIND) as made:
        (made / "labels").mkdir()
        for note, sample in samples:
            place = made / "pictures" / plain_name(note.id)
            place.mkdir(parents=True)
            for camera, picture in zip(note.cameras, sample.pictures, strict=True):
                _write_picture(place / f"{plain_name(camera.name)}.{suffix}", picture)
            _write_labels(made / "labels", plain_name(note.id), sample.labels)
            notes.append(note)
            progress(len(notes), max(count, len(notes)))
        manifest = _Manifest(_Image(**vars(image)), _Grid(**vars(grid)), suffix, notes, left_out or {})
        text = msgspec.json.format(msgspec.json.encode(manifest), indent=1)
        (made / MANIFEST).write_bytes(text + b"\n")


def note_of(
    id: str, scene: str, time_s: float, world_from_ego: Float[np.ndarray, "4 4"], **about: Any
) -> SampleNote:
    """A note; numbers of NumPy become plain ones. ``about`` are the other fields."""
    values = {"id": id, "scene": scene, "time_s": time_s, "world_from_ego": world_from_ego, **about}
    return of_type(json.loads(json.dumps(values, default=_plain)), SampleNote, "sample")


def cameras_of(
    names: Sequence[str],
    pixel_from_camera: Float[np.ndarray, "n 3 3"],
    camera_from_ego: Float[np.ndarray, "n 4 4"],
) -> list[dict[str, Any]]:
    """Cameras as ``note_of`` takes them."""
    return [
        {"name": name, "pixel_from_camera": k, "camera_from_ego": pose}
        for name, k, pose in zip(names, pixel_from_camera, camera_from_ego, strict=True)
    ]


def _check_places(note: SampleNote, where: str) -> None:
    """Whether the car and its cameras stand somewhere and look somewhere."""
    try:
        check_rigid(np.array(note.world_from_ego), "world_from_ego")
        for camera in note.cameras:
            check_rigid(np.array(camera.camera_from_ego), f"camera_from_ego of {camera.name}")
            if not abs(np.linalg.det(np.array(camera.pixel_from_camera))) > _LEAST_AREA:
                raise ValueError(f"pixel_from_camera of {camera.name} has no focal length")
    except ValueError as error:
        raise InputError(f"{where}: sample {note.id}: {error}; make the set again") from None


def _plain(value: Any) -> Any:
    return value.tolist()


def _write_picture(path: Path, picture: UInt8[np.ndarray, "3 h w"]) -> None:
    write_picture(path, picture.transpose(1, 2, 0)[..., ::-1], quality=_JPEG)


def _write_labels(folder: Path, name: str, labels: BevLabels) -> None:
    write_picture(folder / f"{name}.png", labels.bits().astype(np.uint16))
    write_picture(folder / f"{name}_visibility.png", labels.visibility)
    flat = labels.auxiliary.reshape(-1, 8)
    cells = np.flatnonzero(flat[:, 0] > 0)
    np.savez_compressed(folder / f"{name}.npz", cells=cells, values=flat[cells].astype(np.float32))
