"""Bodies: a Gaussian mixture per link, fitted to the robot's meshes."""

from sidestep.body.body import Body
from sidestep.body.cover import CoverSettings, LinkCover, TradeOff
from sidestep.body.cover_report import CoverRow, cover_table, plot_cover
from sidestep.body.fitting import FitSettings, LinkFit
from sidestep.body.mixture import Mixture, fit_mixture
from sidestep.body.report import FitRow, fit_table, plot_fit
from sidestep.body.sampling import sample_link, sample_surface
from sidestep.body.selection import CriterionCurve, criterion_curve

__all__ = [
    "Body",
    "CoverRow",
    "CoverSettings",
    "CriterionCurve",
    "FitRow",
    "FitSettings",
    "LinkCover",
    "LinkFit",
    "Mixture",
    "TradeOff",
    "cover_table",
    "criterion_curve",
    "fit_mixture",
    "fit_table",
    "plot_cover",
    "plot_fit",
    "sample_link",
    "sample_surface",
]
