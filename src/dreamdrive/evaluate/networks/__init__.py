"""Networks whose features figures are made of; weights are files that the user has."""

from dreamdrive.evaluate.networks import efficientnet_lite, i3d, inception, lpips, stlpips, transnet
from dreamdrive.evaluate.networks.i3d import MIN_FRAMES
from dreamdrive.evaluate.networks.packaged import MissingWeightsError
