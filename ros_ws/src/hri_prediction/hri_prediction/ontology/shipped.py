"""What ships: made from simulated dyads."""

from __future__ import annotations

from pathlib import Path

import hri_prediction

_MODELS = Path(hri_prediction.__file__).parent / "models"

SHIPPED = _MODELS / "interaction_cases.npz"
"""Classifier of the twenty cases, by ``scripts/train_ontology.py``."""
SHIPPED_COSTS = _MODELS / "interaction_costs.json"
"""Costs of nearness in each case, by ``scripts/learn_costs.py``."""
