"""Probabilistic movement primitives: basis, distribution, learning, incremental filtering."""

from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.filtering import WeightFilter
from hri_prediction.promp.learning import Demonstration, LearningConfig, WeightPrior, learn
from hri_prediction.promp.model import ProMP, load_promp, save_promp

__all__ = [
    "Demonstration",
    "LearningConfig",
    "PhaseBasis",
    "ProMP",
    "WeightFilter",
    "WeightPrior",
    "learn",
    "load_promp",
    "save_promp",
]
