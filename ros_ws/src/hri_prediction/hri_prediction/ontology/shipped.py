"""The classifier that ships: trained on simulated dyads by ``scripts/train_ontology.py``."""

from __future__ import annotations

from pathlib import Path

import hri_prediction

SHIPPED = Path(hri_prediction.__file__).parent / "models" / "interaction_cases.npz"
"""Of the twenty cases."""
