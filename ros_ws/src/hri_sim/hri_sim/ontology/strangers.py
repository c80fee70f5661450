"""What the classifier that ships makes of segments of people whom it has not learnt."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hri_prediction.ontology.classifier import InteractionClassifier
from hri_prediction.ontology.evaluation import Confusion, confusion
from hri_prediction.ontology.shipped import SHIPPED
from hri_prediction.ontology.table import SegmentTable
from hri_prediction.ontology.verdict import grouped


@dataclass(frozen=True, eq=False)
class Shipped:
    """What came of it.

    Attributes:
        about: What it has learnt.
        cases: What cases were taken for.
        classes: What classes of the reduced ontology were taken for, as the monitor says them.
        unlike: Share of segments that it says to be unlike what it has learnt.
        sure: Mean of the probabilities that it gave the case it said.
    """

    about: str
    cases: Confusion
    classes: Confusion
    unlike: float
    sure: float

    def to_mapping(self) -> dict[str, Any]:
        """As in ``results.json``; shares from 0 to 1."""
        return {
            "about": self.about,
            "full": round(self.cases.overall, 4),
            "mean_of_cases": round(float(np.nanmean(self.cases.rates)), 4),
            "grouped": round(self.classes.overall, 4),
            "unlike": round(self.unlike, 4),
            "sure": round(self.sure, 4),
        }

    def lines(self, *, strangers: bool) -> list[str]:
        """The part of a report on it.

        Args:
            strangers: Whether it is known to have learnt none of these people, and their table.
        """
        what = (
            ", and none of the people and recordings here: what a monitor does for two people whom it does "
            "not know, at a table that it knows, but for how far its places are moved from one recording "
            "to the next"
        )
        rows = [
            f"| {name} | {100 * one.overall:.1f} % | {100 * float(np.nanmean(one.rates)):.1f} % | "
            f"{100 * one.rates[least]:.0f} % ({one.classes[least]}) |"
            for name, one in (
                ("20 cases", self.cases),
                ("7 classes, as the monitor says them", self.classes),
            )
            for least in (int(np.nanargmin(one.rates)),)
        ]
        return [
            "### The classifier that ships\n",
            f"It has learnt {self.about}{what if strangers else ''}.\n",
            "| | of segments | mean of the classes | least of a class |",
            "| --- | --- | --- | --- |",
            *rows,
            "",
            f"It was sure of {100 * self.sure:.0f} % in the mean, where {100 * self.cases.overall:.0f} % "
            f"were so; {100 * self.unlike:.1f} % of them it said to be unlike what it has learnt.\n",
        ]


def judge_shipped(table: SegmentTable) -> Shipped:
    """Ask the classifier that ships.

    Args:
        table: Segments that it has not learnt.
    """
    model = InteractionClassifier.load(SHIPPED)
    given = model.probabilities(table.features)
    numbers, sums = grouped(model.classes, given)
    found = model.classes[given.argmax(axis=1)]
    return Shipped(
        model.about,
        confusion(table.case, found, np.union1d(model.classes, table.case)),
        confusion(table.group, numbers[sums.argmax(axis=1)], np.union1d(numbers, table.group)),
        float((model.strangeness(table.features) > 1.0).mean()),
        float(given.max(axis=1).mean()),
    )
