"""nuScenes: scenes with six cameras, boxes on tracks, lidar and maps, from its plain tables."""

from dreamdrive.data.dataset import Logs
from dreamdrive.data.logs import data_set_of_logs
from dreamdrive.data.nuscenes.log import is_nuscenes, read_nuscenes, scenes_of_nuscenes
from dreamdrive.data.nuscenes.tables import open_tables
from dreamdrive.data.nuscenes.write import KIND, write_nuscenes, write_points

NUSCENES = data_set_of_logs(
    name="nuscenes",
    about="a folder of nuScenes with the tables of one version in it, such as v1.0-mini",
    recognises=is_nuscenes,
    logs=Logs(scenes_of_nuscenes, read_nuscenes),
)
