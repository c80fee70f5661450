"""Probabilistic movement primitives: basis, distribution, learning, filtering, storage."""

from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.filtering import WeightFilter
from hri_prediction.promp.learning import LearningConfig, WeightPrior, learn
from hri_prediction.promp.model import ProMP
from hri_prediction.promp.regression import Demonstration
from hri_prediction.promp.storage import load_promp, save_promp

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
