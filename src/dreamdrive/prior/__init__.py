"""Priors: from a control to a clip with features."""

from dreamdrive.choices import PRIORS
from dreamdrive.prior.auto import Choice, auto_prior, variable_of
from dreamdrive.prior.protocol import Prior
from dreamdrive.prior.street_world import FRAMES, SIZE

choose_prior = PRIORS.choose
