"""What can be seen in the frames alone: features, motion, regions fixed to the camera."""

from dreamdrive.geometry.evidence import features
from dreamdrive.geometry.evidence.features import Features
from dreamdrive.geometry.evidence.motion import track
from dreamdrive.geometry.evidence.observation import (
    Evidence,
    find_features,
    free_pixels,
    observe,
    resized,
    shows_little,
    working_frames,
)
