"""Seeding and fitting of Gaussians."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.fit import trainer as trainer
    from dreamdrive.fit.densify import (
        DENSIFIERS as DENSIFIERS,
        Densifier as Densifier,
        DensifySettings as DensifySettings,
        GradientDensifier as GradientDensifier,
    )
    from dreamdrive.fit.exposure import ExposureNetwork as ExposureNetwork
    from dreamdrive.fit.hybrid import Parts as Parts, fit as fit
    from dreamdrive.fit.initialise import SeedOptions as SeedOptions, initialise as initialise
    from dreamdrive.fit.losses import WEIGHTS as WEIGHTS, LossName as LossName, render_loss as render_loss
    from dreamdrive.fit.memory import (
        FitMemory as FitMemory,
        FitSize as FitSize,
        check_fit as check_fit,
        most_gaussians as most_gaussians,
        plan_fit as plan_fit,
    )
    from dreamdrive.fit.parameters import LearningRates as LearningRates, Parameters as Parameters
    from dreamdrive.fit.static import (
        StaticFit as StaticFit,
        fit_static as fit_static,
        footprints as footprints,
    )
    from dreamdrive.fit.trainer import FitOptions as FitOptions, Model as Model, Trainer as Trainer
    from dreamdrive.fit.trial import (
        Trial as Trial,
        TrialOptions as TrialOptions,
        better_depth as better_depth,
        trial as trial,
    )
    from dreamdrive.fit.views import View as View

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
