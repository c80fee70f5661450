"""Warming all packages leaves nothing to the parts, and the halves are all of it."""

from __future__ import annotations

import subprocess
import sys

import hri_planner.warm
from hri_sim import warm

AGAIN = """
from hri_prediction.compiled import compiled_variants
from hri_sim.warm import warm_kernels
warm_kernels()
before = compiled_variants()
import hri_planner.warm, hri_prediction.ontology.warm, hri_prediction.warm
hri_prediction.warm.warm_kernels()
hri_prediction.ontology.warm.warm_watch()
hri_planner.warm.warm_kernels()
assert compiled_variants() == before
"""


def test_parts_have_nothing_left_to_compile() -> None:
    """In a process of its own, as kernels stay compiled in the one that asks for them."""
    subprocess.run([sys.executable, "-c", AGAIN], check=True)


def test_halves_hold_all_parts_of_the_planner() -> None:
    assert [part for half in warm.PARTS for part in half if part in hri_planner.warm.PARTS] == [
        *hri_planner.warm.PARTS
    ]
