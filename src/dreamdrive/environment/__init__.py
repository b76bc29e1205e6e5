"""Closed-loop driving in generated scenes, as the gymnasium environment ``DreamDrive-v0``."""

try:
    import gymnasium
except ImportError:
    raise ImportError(
        "dreamdrive.environment needs gymnasium, which is not installed; "
        "pip install 'dreamdrive[environment]'"
    ) from None

from dreamdrive.environment.bicycle import EgoOptions
from dreamdrive.environment.env import DreamDriveEnv
from dreamdrive.environment.observation import NAMES
from dreamdrive.environment.options import EnvironmentOptions, StartOptions
from dreamdrive.environment.pictures import PictureOptions
from dreamdrive.environment.reward import RewardOptions
from dreamdrive.environment.rig import Mount, mount
from dreamdrive.environment.road import Road, road_of_layout, road_of_log
from dreamdrive.environment.traffic import TrafficOptions

gymnasium.register("DreamDrive-v0", entry_point="dreamdrive.environment.env:DreamDriveEnv")
