"""Drives of data sets, their lidar, and sets of samples and records for training."""

import gzip
from pathlib import Path

import numpy as np

from dreamdrive.data.input import dataset_of
from dreamdrive.datasets.argoverse import read_argoverse
from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.export.nuscenes.writer import write_nuscenes
from dreamdrive.scene.street.log import Log
from dreamdrive.tasks.perception import BevGrid, BevSet, ImageSize, samples_of_log, write_bev_set
from dreamdrive_train.street_network.data.mixture import read_entries
from dreamdrive_train.street_network.data.picture import read_entry
from tests.datasets import test_argoverse as argoverse
from tests.datasets.kitti import conftest as kitti
from tests.datasets.pandaset import conftest as pandaset
from tests.logs import log
from tests.mutation.reader import Reader
from tests.records import write_folder

_IMAGE, _GRID = ImageSize(24, 64, 12), BevGrid(40, 40)


def _check(made: Log) -> None:
    """What all uses of a log rest on."""
    assert np.isfinite(made.world_from_ego).all()
    assert (np.diff(made.times_s) > 0).all()
    for box in made.boxes:
        assert np.isfinite(box.world_from_box).all()
        assert (box.size_lwh_m > 0).all()
    for sweep in made.sweeps[:1]:
        if sweep.file.is_file():
            assert np.isfinite(read_points(sweep.file)).all()


def _open(path: Path, name: str) -> None:
    logs = dataset_of(name, path).logs
    assert logs is not None
    _check(logs.open(path, None))


def _nuscenes(folder: Path) -> None:
    write_nuscenes([log(folder / "made")], folder / "set", read_points)


def _points(name: str, data: bytes) -> Reader:
    def read(folder: Path) -> None:
        assert np.isfinite(read_points(folder / name)).all()

    return Reader(f"lidar-{name}", lambda folder: (folder / name).write_bytes(data), read)


def _sweep(folder: Path) -> None:
    points = {name: np.arange(50.0) for name in "xyzit"}
    pandaset.write_table(folder / "a.pkl.gz", points | {"d": np.zeros(50, int)})
    (folder / "a.pkl").write_bytes(gzip.decompress((folder / "a.pkl.gz").read_bytes()))


def _samples(folder: Path) -> None:
    made = samples_of_log(log(folder / "made"), _IMAGE, _GRID)
    write_bev_set(made, folder / "set", _IMAGE, _GRID, count=3, suffix="png")


def _read_samples(folder: Path) -> None:
    for sample in BevSet.open(folder / "set"):
        assert np.isfinite(sample.pixel_from_camera).all()
        assert np.isfinite(sample.labels.auxiliary).all()


def _read_records(folder: Path) -> None:
    for entry in read_entries([folder / "records"]):
        read_entry(entry)


LOGS: tuple[Reader, ...] = (
    *(
        Reader(
            f"log-argoverse{ending}",
            lambda folder, ending=ending: argoverse.write(folder, ending=ending),
            lambda folder: _check(read_argoverse(folder)),
        )
        for ending in argoverse.WRITERS
    ),
    *(
        Reader(f"log-{name}", write, lambda folder, name=name, at=at: _open(folder / at, name), spoils=spoils)
        for name, at, write, spoils in (
            # Pictures have readers of their own.
            ("pandaset", "PandaSet", lambda folder: pandaset.write_small(folder / "PandaSet"), "*[!g]"),
            ("kitti-raw", "raw", kitti.write_small, "raw/*.[tx]*"),
            ("kitti-odometry", "odometry", kitti.write_small, "odometry/*.txt"),
            ("nuscenes", "set", _nuscenes, "set/*.json"),
        )
    ),
    Reader(
        "log-pandaset-tables",
        lambda folder: pandaset.write_small(folder / "PandaSet"),
        lambda folder: _open(folder / "PandaSet", "pandaset"),
        spoils="*.pkl.gz",
    ),
    _points("a.pcd.bin", np.arange(50, dtype="<f4").tobytes()),
    _points("a.bin", np.arange(40, dtype="<f4").tobytes()),
    *(
        Reader(
            f"lidar-{name}",
            _sweep,
            lambda folder, name=name: read_points(folder / name),
            spoils=name,
        )
        for name in ("a.pkl", "a.pkl.gz")
    ),
    Reader("samples", _samples, _read_samples, spoils="set/*"),
    Reader(
        "records", lambda folder: write_folder(folder / "records", range(1), size=(32, 20)), _read_records
    ),
)
