"""Priors: from a control to a clip with features."""

from dreamdrive.choices import PRIORS
from dreamdrive.prior.auto import Choice, auto_prior, variable_of
from dreamdrive.prior.protocol import Prior
from dreamdrive.prior.street import read_street, told_of_street, wanted_frames
from dreamdrive.prior.street_world import FRAMES, RATE_HZ, SIZE

choose_prior = PRIORS.choose
