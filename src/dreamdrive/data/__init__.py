"""Readers: recordings, calibration, poses and trajectories on disk, converted at the door.

All of them raise ``InputError`` where a file or an option cannot be used.
"""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.data.cameras.lens import SourceLens as SourceLens
    from dreamdrive.data.cameras.poses import (
        read_trajectories as read_trajectories,
        read_trajectory as read_trajectory,
        write_trajectory as write_trajectory,
    )
    from dreamdrive.data.clip_reader import read_clip as read_clip
    from dreamdrive.data.dataset import DataSet as DataSet, Logs as Logs, choose_scene as choose_scene
    from dreamdrive.data.input import dataset_of as dataset_of, log_of as log_of, read_dataset as read_dataset

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
