"""Online prediction of reaches from a library of known tasks."""

from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskLibrary, TaskModel, train_library
from hri_prediction.prediction.output import Prediction, ReachState
from hri_prediction.prediction.predictor import ReachPredictor

__all__ = [
    "Prediction",
    "PredictorConfig",
    "ReachPredictor",
    "ReachState",
    "TaskLibrary",
    "TaskModel",
    "train_library",
]
