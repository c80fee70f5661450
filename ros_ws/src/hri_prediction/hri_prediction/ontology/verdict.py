"""What is said of a movement: the likeliest case, and the likeliest class of the reduced ontology."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.ontology.cases import group_of
from hri_prediction.ontology.classifier import InteractionClassifier

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


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
    groups, (shares,) = grouped(classifier.classes, given[None])
    best, likeliest = int(given.argmax()), int(shares.argmax())
    return Verdict(
        int(classifier.classes[best]),
        float(given[best]),
        int(groups[likeliest]),
        float(shares[likeliest]),
        given,
        classifier.unlike(features),
    )


def grouped(numbers: IntArray, probabilities: FloatArray) -> tuple[IntArray, FloatArray]:
    """Classes of the reduced ontology (g,), increasing, and their probabilities (n, g).

    Args:
        numbers: Of cases (c,).
        probabilities: Of these (n, c).
    """
    groups, of_case = np.unique([group_of(int(one)) for one in numbers], return_inverse=True)
    sums = np.zeros((len(probabilities), len(groups)))
    for column, group in enumerate(of_case.tolist()):
        sums[:, group] += probabilities[:, column]
    return groups.astype(np.int64), sums
