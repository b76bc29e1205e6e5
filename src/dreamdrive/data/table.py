"""Data sets by their names."""

from typing import TYPE_CHECKING

from dreamdrive.registry import Table

if TYPE_CHECKING:
    from dreamdrive.data.dataset import DataSet

DATASETS: "Table[DataSet]" = Table(
    "--dataset",
    "dreamdrive.datasets",
    "dreamdrive.data:DataSet",
    {
        "rig": "dreamdrive.data.rig:RIG_FOLDER",
        "nuscenes": "dreamdrive.datasets.nuscenes:NUSCENES",
        "pandaset": "dreamdrive.datasets.pandaset:PANDASET",
        "kitti-raw": "dreamdrive.datasets.kitti:KITTI_RAW",
        "kitti-odometry": "dreamdrive.datasets.kitti:KITTI_ODOMETRY",
        "recording": "dreamdrive.data.clip_reader:RECORDING",
    },
)
"""From a path to the clip of a recording, see ``data.dataset_of``."""
