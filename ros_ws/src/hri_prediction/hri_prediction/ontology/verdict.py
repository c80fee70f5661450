"""What is said of a movement: the likeliest case, and the likeliest class of the reduced ontology."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.ontology.cases import group_of
from hri_prediction.ontology.classifier import InteractionClassifier

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Verdict:
    """What mean features are taken for.

    Attributes:
        number: The likeliest case.
        probability: Its probability.
        group: The likeliest class of the reduced ontology.
        group_probability: Its probability: the sum of those of its cases.
        probabilities: Of all cases that the classifier knows, in their order (c,).
        unlike: Why they say little: the features are unlike those that were learnt; empty: they are not.
    """

    number: int
    probability: float
    group: int
    group_probability: float
    probabilities: FloatArray
    unlike: str = ""


def verdict_on(classifier: InteractionClassifier, features: FloatArray) -> Verdict:
    """What mean features (25,) [m] of a movement are taken for."""
    (given,) = classifier.probabilities(features[None])
    groups: dict[int, float] = {}
    for number, share in zip(classifier.classes.tolist(), given.tolist(), strict=True):
        groups[group_of(number)] = groups.get(group_of(number), 0.0) + share
    best = int(given.argmax())
    group = max(groups, key=lambda name: groups[name])
    unlike = classifier.unlike(features)
    number, probability = int(classifier.classes[best]), float(given[best])
    return Verdict(number, probability, group, groups[group], given, unlike)
