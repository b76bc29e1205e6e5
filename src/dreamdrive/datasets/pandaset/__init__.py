"""PandaSet: sequences of eight seconds with six cameras, cuboids and lidar, as its devkit lays them out."""

from dreamdrive.data.dataset import Logs
from dreamdrive.datasets.logs import data_set_of_logs
from dreamdrive.datasets.pandaset.log import is_pandaset, read_pandaset, scenes_of_pandaset

PANDASET = data_set_of_logs(
    name="pandaset",
    about="a folder of PandaSet with sequences such as 001 in it, or one of them, with its folder camera",
    recognises=is_pandaset,
    logs=Logs(scenes_of_pandaset, read_pandaset),
)
