"""What is said before anything starts."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from rich.console import Console

from hri_prediction.ontology.cost_file import CaseCosts, LearntCosts
from hri_prediction.ontology.costs import NUMBER
from hri_sim.launch.parameters import interaction_of
from hri_sim.launch.run import RunOptions, prepare


def test_warnings_of_learnt_costs(tmp_path: Path) -> None:
    one = CaseCosts(np.ones(NUMBER), np.ones(NUMBER), 1)
    warnings = ("case_3: the weights hang on what was drawn", "case_4: of no use")
    LearntCosts({"case_3": one, "case_4": one}, 0.3, "", warnings).save(tmp_path / "costs.json")
    (tmp_path / "near.yaml").write_text(
        f"ptomp: {{planner.interaction_costs: case_3, planner.interaction_file: {tmp_path}/costs.json}}"
    )
    run = RunOptions(out=tmp_path / "run", parameters=tmp_path / "near.yaml", planner="stomp")
    run.out.mkdir()
    console = Console(file=(said := io.StringIO()), width=200)
    prepared = prepare(run, run.out / "bag", console)
    words = (
        "interaction_costs: case_3: the weights hang on what was drawn; they are used all the same"
    )
    assert said.getvalue().splitlines() == [words]
    parameters = {spec.label: spec.parameters for spec in prepared.specs}
    assert interaction_of(parameters) == ("case_3", str(tmp_path / "costs.json"))
