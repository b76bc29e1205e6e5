"""Readers: recordings, calibration, poses and trajectories on disk, converted at the door.

All of them raise ``InputError`` where a file or an option cannot be used.
"""

from dreamdrive.data.clip_reader import read_clip
from dreamdrive.data.dataset import DataSet, Logs, choose_scene, dataset_of, log_of, read_dataset
from dreamdrive.data.lens import Lens
from dreamdrive.data.poses import read_trajectories, read_trajectory, write_trajectory
