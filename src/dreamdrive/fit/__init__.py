"""Seeds become Gaussians, and Gaussians are fitted to the frames."""

from dreamdrive.fit.densify import DENSIFIERS, Densifier, DensifySettings, GradientDensifier
from dreamdrive.fit.hybrid import Parts, fit
from dreamdrive.fit.initialise import SeedOptions, initialise
from dreamdrive.fit.losses import LossName, render_loss
from dreamdrive.fit.static import StaticFit, fit_static
from dreamdrive.fit.trainer import FitOptions
from dreamdrive.fit.trial import Trial, TrialOptions, better_depth, trial
