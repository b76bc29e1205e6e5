"""KITTI (Geiger et al. 2013): raw drives with their boxes, and sequences of the odometry benchmark."""

from dreamdrive.data.dataset import Logs
from dreamdrive.datasets.kitti.odometry import (
    is_kitti_odometry,
    read_kitti_odometry,
    scenes_of_kitti_odometry,
)
from dreamdrive.datasets.kitti.raw import is_kitti_raw, read_kitti_raw, scenes_of_kitti_raw
from dreamdrive.datasets.logs import data_set_of_logs

KITTI_RAW = data_set_of_logs(
    name="kitti-raw",
    about="a raw drive of KITTI such as 2011_09_26/2011_09_26_drive_0001_sync, or a folder with drives",
    recognises=is_kitti_raw,
    logs=Logs(scenes_of_kitti_raw, read_kitti_raw),
)
KITTI_ODOMETRY = data_set_of_logs(
    name="kitti-odometry",
    about="the folder of KITTI's odometry benchmark with sequences and poses in it, or one of its sequences",
    recognises=is_kitti_odometry,
    logs=Logs(scenes_of_kitti_odometry, read_kitti_odometry),
)
