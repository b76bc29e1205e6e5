"""Closed-loop driving in generated scenes, as the gymnasium environment ``DreamDrive-v0``."""

from dreamdrive.errors import installing

try:
    import gymnasium
except ImportError:
    raise ImportError(
        f"dreamdrive.tasks.environment needs gymnasium, which is not installed; {installing('environment')}"
    ) from None

from dreamdrive.tasks.environment.bicycle import EgoOptions
from dreamdrive.tasks.environment.env import DreamDriveEnv
from dreamdrive.tasks.environment.observation import NAMES
from dreamdrive.tasks.environment.options import EnvironmentOptions, StartOptions
from dreamdrive.tasks.environment.pictures import PictureOptions
from dreamdrive.tasks.environment.reward import RewardOptions
from dreamdrive.tasks.environment.rig import Mount, mount
from dreamdrive.tasks.environment.road import DrivableArea, road_of_layout, road_of_log
from dreamdrive.tasks.environment.traffic import TrafficOptions

gymnasium.register("DreamDrive-v0", entry_point="dreamdrive.tasks.environment.env:DreamDriveEnv")
