"""Frames as a video model would have drawn them: what is wrong with generated video, put on a true clip."""

from dreamdrive.world.corruption.effects import corrupt
from dreamdrive.world.corruption.settings import PRESETS, Corruption, parse_corruption
