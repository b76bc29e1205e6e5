"""What can be seen in the frames alone: features, motion, regions fixed to the camera."""

from dreamdrive.geometry.evidence import features, look
from dreamdrive.geometry.evidence.features import Features
from dreamdrive.geometry.evidence.look import Evidence, free_pixels
from dreamdrive.geometry.evidence.motion import track
