"""nuScenes: scenes with six cameras, boxes on tracks, lidar and maps, from its plain tables."""

from dreamdrive.data.dataset import Logs
from dreamdrive.datasets.logs import data_set_of_logs
from dreamdrive.datasets.nuscenes.log import is_nuscenes, read_nuscenes, scenes_of_nuscenes
from dreamdrive.datasets.nuscenes.tables import open_tables

NUSCENES = data_set_of_logs(
    name="nuscenes",
    about="a folder of nuScenes with the tables of one version in it, such as v1.0-mini",
    recognises=is_nuscenes,
    logs=Logs(scenes_of_nuscenes, read_nuscenes),
)
