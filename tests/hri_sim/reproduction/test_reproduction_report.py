"""What the planner's report says of bars, leads, the thesis and late starts."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from hri_sim.benchmark.outcome import Outcome
from hri_sim.benchmark.planners import find_planners
from hri_sim.benchmark.rows import Done
from hri_sim.benchmark.run import Plan
from hri_sim.benchmark.summary import summarise
from hri_sim.reproduction import headline, leads, missed, starts, thesis
from hri_sim.reproduction.bars import BARS, ITOMP, OURS, SLOWDOWNS, bar_lines, judge
from hri_sim.reproduction.elsewhere import ELSEWHERE, judge_elsewhere
from hri_sim.reproduction.section import Measured, Scope

GOOD = Outcome(0.06, 0.02, 1e-5, 1e-4, 1.5, 1.0, 0.01, 30.0, 0.4, 42, 0, 900)
BAD = replace(GOOD, clearance=-0.01, time_to_collision=0.0)
SLOW = replace(GOOD, time_to_goal=2.0)
SMOKE = Scope((3,), smoke=True)


def measured(names, slowdown, make) -> Measured:
    plan: Plan = SMOKE.plan(find_planners(names), slowdown)
    done = {unit: Done(unit, (make(unit),), 2.0) for unit in plan.units}
    return Measured(plan, done, summarise(plan, done))


# ------------------------------------------------------------------ bars of other commands
def test_bars_of_other_commands_are_read_with_their_origin(tmp_path):
    assert {bar["met"] for bar in judge_elsewhere(tmp_path)} == {None}
    machine = {"cpu": "CPU", "cores": 2, "python": "3.11"}
    kernel = {
        "ratios": {"config": {"numpy": 51.0}, "iteration": {"numpy": 30.0}},
        "rollouts_per_s": 332_359.0,
        "forecast_ms": 2.5,
        "origin": {"commit": "abc", "date": "2026-11-21", "machine": machine},
    }
    (tmp_path / "kernel").mkdir()
    (tmp_path / "kernel" / "results.json").write_text(json.dumps(kernel))
    (tmp_path / "graph").mkdir()
    (tmp_path / "graph" / "results.json").write_text("{")  # being written
    judged = judge_elsewhere(tmp_path)
    assert [bar["met"] for bar in judged] == [False, True, True, False, None, None]
    text = "\n".join(bar_lines(judged))
    assert "2 met, 2 missed, 2 not measured." in text
    where = "`kernel/results.json`: Commit abc, 2026-11-21; CPU, 2 cores, Python 3.11."
    assert f"| 51 × | ≥ 60 × | **missed** | {where} |" in text
    assert "| 332,359 1/s | ≥ 200,000 1/s | met |" in text
    assert "| late plans in the live graph | – | ≤ 0.5 % | not measured | – |" in text
    assert len(judged) == len(ELSEWHERE)


# ------------------------------------------------------------------ missed bars
def test_missed_bars_are_looked_at_and_met_ones_are_not():
    found = {slow: measured(headline.PLANNERS, slow, lambda unit: GOOD) for slow in SLOWDOWNS}
    judged = [judge(bar, found) for bar in BARS]
    text = "\n".join(missed.lines(judged, found))
    assert text.count("### ") == sum(bar["against"] is not None for bar in judged)
    assert f"### ok, more than `{ITOMP}`, F = 1: +0.0" in text
    assert f"`{ITOMP}` has 100.0 % itself: a lead can be at most +0.0 points, less than" in text
    assert f"| person must move | `{ITOMP}` |" in text
    assert "| ok | F = 1 | F = 64 |" in text
    # Two bars against the same planner have the table by kind in common.
    assert text.count(f"| ambiguous | `{ITOMP}` |") == len(found)
    assert missed.TRIED in text
    met = [{**bar, "met": True} for bar in judged]
    assert missed.lines(met, found) == ["No bar of the benchmark was missed.\n"]


def test_what_was_tried_for_bars_of_other_commands_is_said(tmp_path):
    kernel = judge_elsewhere(tmp_path)[0]
    low = {**kernel, "measured": 51.0, "met": False}
    text = "\n".join(missed.lines([low], {}))
    assert f"### {kernel['what']}: 51 ×, wanted ≥ 60 ×" in text
    assert missed.TRIED_ELSEWHERE[kernel["what"]] in text
    unknown = missed.lines([kernel], {})
    assert unknown == ["No bar of the benchmark was missed.\n"]


# ------------------------------------------------------------------ leads
def test_leads_are_taken_apart():
    outcomes = {ITOMP: BAD, leads.TIMING: SLOW}
    plan = leads.plans(SMOKE)["F64"]
    done = {unit: Done(unit, (outcomes.get(unit.planner, GOOD),), 2.0) for unit in plan.units}
    one = Measured(plan, done, summarise(plan, done))
    found = leads.leads(one)
    assert found[f"{OURS} - {ITOMP}"]["ok"] == 1.0
    assert found[f"{OURS} - {leads.VELOCITY}"]["ok"] == 0.0
    assert found[f"{OURS} - {leads.TIMING}"]["time_to_goal_s"] == pytest.approx(-0.5)
    text = "\n".join(leads.lines({"F64": one}))
    assert "F = 64, in points of ok: +100.0 (+100.0 at 2 cm) in all" in text
    assert f"| `{OURS}` − `{leads.VELOCITY}` |" in text


# ------------------------------------------------------------------ thesis
def test_the_thesis_stands_beside_what_corresponds():
    first = measured(headline.PLANNERS, 1.0, lambda unit: GOOD)
    chosen = measured((OURS, "ptomp_gpr"), 64.0, lambda unit: SLOW)
    text = "\n".join(thesis.lines([first, chosen]))
    assert "| 402 of 450 (89.3 %) | `ptomp_gpr`, F = 64, 2 motions | 100.0 % (" in text
    assert "| 98 % | `ptomp_gpr_lower`: not measured | – | – |" in text
    assert "| 67 of 450 (14.9 %) | – | – | – |" in text
    assert f"| – | – | `{OURS}`, fixed (42, 30), F = 1, 2 motions |" in text


# ------------------------------------------------------------------ late starts
def test_starts_are_those_of_each_planner():
    plan = SMOKE.plan(find_planners((OURS, "nominal")), 64.0)
    found = starts.starts(plan)
    assert found["nominal"] == {"delay_s": 0.0, "still_collides": 1.0}
    assert found[OURS]["delay_s"] > 0.3
    assert "| `nominal` | 0.00 | 100.0 % |" in starts.table(found)
