"""The parts of the planner's report: bars, sections, closer looks, failures, scenes, surfaces, times."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.execution import PAPER
from hri_sim.benchmark.outcome import Outcome
from hri_sim.benchmark.planners import NOMINAL, PLANNERS, find_planners
from hri_sim.benchmark.rows import Done
from hri_sim.benchmark.run import Plan, marks
from hri_sim.benchmark.summary import summarise
from hri_sim.benchmark.variation import Variation
from hri_sim.media.look import camera_for
from hri_sim.reproduction import (
    drawing,
    failures,
    headline,
    people,
    postures,
    scenes,
    surfaces,
    times,
    variants,
)
from hri_sim.reproduction.adaptation import FIXED
from hri_sim.reproduction.bars import BARS, ITOMP, OURS, Bar, bar_lines, judge
from hri_sim.reproduction.closer import Item, KeptLooks, Look, collision_cost, look
from hri_sim.reproduction.section import Measured, Scope
from hri_sim.reproduction.sections import SECTIONS

GOOD = Outcome(0.06, 0.02, 1e-5, 1e-4, 1.5, 1.0, 0.01, 30.0, 0.4, 42, 0, 900)
BAD = replace(GOOD, clearance=-0.01, time_to_collision=0.0)
LOST = replace(GOOD, time_to_goal=None, hold_clearance=None, hold_error=None)
SEEN = Look(GOOD, 0.5, 0.8, None, False, "hand", "forearm")
SMOKE = Scope((3,), smoke=True)


def measured(plan: Plan, make) -> Measured:
    done = {unit: Done(unit, tuple(make(unit)), 2.0) for unit in plan.units}
    return Measured(plan, done, summarise(plan, done))


def headline_of(make) -> Measured:
    return measured(SMOKE.plan(find_planners(headline.PLANNERS), 1.0), make)


# ------------------------------------------------------------------ bars
def test_bars_are_met_exactly_and_missed_below():
    one = headline_of(lambda unit: [BAD if unit.planner == ITOMP and unit.task else GOOD])
    for bar, met in (
        (Bar("ok", 1.0, 1.0), True),
        (Bar("ok", 1.0, 0.5, against=ITOMP), True),
        (Bar("ok", 1.0, 0.5 + 1e-6, against=ITOMP), False),
        (Bar("ok", 1.0, 1.0, against=ITOMP, ambiguous=True), True),  # task 4, not task 0
        (Bar("ok", 64.0, 0.0), False),  # nothing was measured
        (Bar("ok", 1.0, 0.0, against="nobody"), False),
    ):
        assert judge(bar, {1.0: one})["met"] is met, bar.what
    text = "\n".join(bar_lines([judge(bar, {1.0: one}) for bar in BARS]))
    assert "5 met, 5 missed." in text  # of F = 64 nothing was measured; STOMP is as good
    assert f"| ok, more than `{ITOMP}`, F = 1 | +50.0 (" in text
    assert ") | ≥ 10 points | met | here |" in text
    assert "| ok, F = 64 | – | ≥ 90 % | **missed** | here |" in text


# ------------------------------------------------------------------ sections
def test_sections_measure_test_tasks_and_share_what_they_have_in_common():
    assert len({section.name for section in SECTIONS}) == len(SECTIONS)
    found = {
        (section.name, name): plan
        for section in SECTIONS
        for name, plan in section.plans(Scope((0, 1))).items()
    }
    for (section, _), plan in found.items():
        many = section in ("headline", "leads")
        assert (plan.split, len(plan.tasks) * plan.conditions) == ("test", 450 if many else 90)
        assert plan.seeds == ((0, 1) if section == "headline" else (0,))
        assert plan.planners[0].name == (FIXED if section == "adaptation" else OURS)
    usual = [
        plan
        for (section, _), plan in found.items()
        if section not in ("headline", "leads") and plan.slowdown == 1.0
        if plan.variation == Variation() and plan.execution == PAPER
    ]
    assert len(usual) > 4
    whole = {marks(found[name, "F1"])[OURS] for name in ("headline", "leads")}
    assert len(whole) == 1
    assert len({marks(plan)[OURS] for plan in usual}) == 1  # done once for all of them
    assert {plan.slowdown for plan in found.values()} == {1.0, 8.0, 64.0, 512.0}
    ablations = {plan.slowdown for (section, _), plan in found.items() if section == "ablations"}
    assert ablations == {1.0, 8.0, 64.0}


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.name)
def test_sections_write_tables(section):
    plans = section.plans(SMOKE)
    text = "\n".join(
        section.lines({name: measured(plan, lambda unit: [GOOD]) for name, plan in plans.items()})
    )
    for plan in plans.values():
        assert all(f"`{setup.name}`" in text for setup in plan.planners)
    assert "100.0 %" in text


def test_changed_settings_differ_from_ours_in_them_alone():
    ours = PLANNERS[OURS].config
    assert variants.with_kappa(0.0).config == replace(ours, kappa=0.0, kappa_min=0.0)
    assert variants.with_margin(0.12).config == replace(ours, margin=0.12)
    few = variants.with_iterations(5)
    assert (few.config, few.max_iterations) == (ours, 5)


# ------------------------------------------------------------------ closer looks
def test_a_closer_look_says_when_and_where_contact_was(tmp_path):
    item = Item(PLANNERS[NOMINAL], "test", 0, 0, 1.0, 0)
    seen = look(item)
    assert seen.outcome == item.watch()[1]
    assert seen.outcome.clearance < 0.0 < seen.collision_cost
    assert 0.0 < seen.contact_s < seen.closest_s < seen.outcome.time_to_goal
    assert (seen.standing, seen.limb) == (False, "hand")
    kept = KeptLooks(tmp_path / "looks.jsonl")
    kept.add(item, seen)
    with (tmp_path / "looks.jsonl").open("a") as stream:
        stream.write('{"mark": "cut o')
    kept.add(replace(item, seed=1), seen)
    assert kept.read() == {item.mark: seen, replace(item, seed=1).mark: seen}
    assert replace(item, slowdown=8.0).mark != item.mark


def test_collision_cost_is_of_the_shortfall():
    distances = np.full((10, 3, 3), 0.2)
    assert collision_cost(distances, 0.07, 0.01) == 0.0
    distances[:, 1, 2] = 0.02
    assert collision_cost(distances, 0.07, 0.01) == pytest.approx(10 * 0.01)


def test_nobody_is_seen():
    item = Item(postures.UNSEEN, "test", 0, 0, 1.0, 0)
    run, outcome = item.watch()
    assert outcome.time_to_goal is not None
    assert outcome.replans > 10
    assert run.arrived is not None


# ------------------------------------------------------------------ failures
@pytest.mark.parametrize(
    ("cause", "outcome"),
    [
        ("contact", BAD),
        ("contact", replace(LOST, clearance=-0.01)),
        ("lost", LOST),
        ("held", replace(GOOD, hold_clearance=-0.001)),
        ("drifted", replace(GOOD, hold_error=0.02)),
        ("fast", replace(GOOD, speed_share=1.2)),
        ("table", replace(GOOD, table_clearance=-0.001)),
    ],
)
def test_failures_have_a_cause_and_words(cause, outcome):
    contact_s = 0.7 if outcome.clearance < 0.0 else None
    item = Item(PLANNERS[OURS], "test", 4, 0, 1.0, 2)
    found = failures.Failure(item, replace(SEEN, outcome=outcome, contact_s=contact_s)).figures()
    assert found["cause"] == cause
    assert found["ambiguous"] is True
    json.dumps(found, allow_nan=False)
    assert failures.lines([found], 10, 64.0) == ["F = 64: none of 10 motions failed.\n"]
    text = "\n".join(failures.lines([found], 10, 1.0))
    assert "1 of 10 motions" in text
    assert f"| {failures.CAUSES[cause]} | 1 | 1 |" in text
    assert "| 4 / 0 / 2 | yes |" in text


def test_every_motion_that_is_no_strict_success_is_a_failure():
    one = headline_of(lambda unit: [LOST if unit.task and unit.planner == OURS else GOOD])
    (item,) = failures.failed_items(one)
    assert (item.setup.name, item.task, item.condition, item.seed) == (OURS, 4, 0, 3)
    deep = replace(GOOD, clearance=0.01)
    one = headline_of(lambda unit: [deep if unit.task and unit.planner == OURS else GOOD])
    item, clearance = failures.worst_item(one)
    assert (item.task, clearance) == (4, 0.01)


# ------------------------------------------------------------------ scenes and surfaces
def test_scenes_keep_to_their_rules():
    scene = scenes.first_moving()
    assert scene.task.split == "test"
    assert scene.staying_clearance >= scenes.STAYING_CLEAR_M
    assert len(scene.task.targets) == 1
    for task in range(scene.task.number):
        for other in task_conditions("test", task).conditions:
            assert other.task.ambiguous or other.staying_clearance < scenes.STAYING_CLEAR_M
    won = headline_of(lambda unit: [BAD if unit.planner == ITOMP and unit.task else GOOD])
    scene, rule = scenes.compared(won)
    assert (scene.task.number, scene.number) == (4, 0)
    assert "1 of 2 conditions are such" in rule
    scene, rule = scenes.compared(headline_of(lambda unit: [GOOD]))
    assert scene.task.number == 0
    assert "none is won" in rule


def test_surfaces_are_means_over_seeds():
    grid = surfaces.Grid(scenes.first_moving(), Scope((0, 1), smoke=True))
    items = grid.items
    assert len(items) == 2 * 2 * 2 * 2
    looks = [
        replace(
            SEEN,
            collision_cost=item.setup.config.num_rollouts + item.seed,
            contact_s=0.5 if item.setup.observer == "promp" and item.seed else None,
        )
        for item in items
    ]
    found = grid.surfaces(looks)
    assert found["certain"]["collision"] == [[5.5, 60.5], [5.5, 60.5]]
    assert found["uncertain"]["contact"] == [[0.5, 0.5], [0.5, 0.5]]
    assert found["certain"]["contact"] == [[0.0, 0.0], [0.0, 0.0]]
    assert found["certain"]["control"] == [[15.0, 15.0], [15.0, 15.0]]
    assert surfaces.worst_cell(grid, found["certain"]) == (60, 60)
    assert {item.setup.config.num_timesteps for item in items} == {10, 60}


def test_pictures_show_the_whole_path():
    scenario = scenes.first_moving().scenario
    inside = np.array([[0.4, 0.0, 0.3]])
    assert drawing.camera_showing(scenario, inside) == camera_for(scenario)
    wide = np.array([[0.4, 0.0, 0.3], [-0.8, 0.0, 1.0], [0.2, 0.9, 1.2]])
    seen = drawing.camera_showing(scenario, wide).project(wide, 880, 760)
    assert (seen > 0.0).all()
    assert (seen < [880.0, 760.0]).all()


def test_what_happens_at_the_goal_is_not_on_the_way():
    item = Item(PLANNERS[NOMINAL], "test", 0, 0, 1.0, 0)
    run = item.watch()[0]
    shown = drawing.Trace("nominal", (0.0, 0.0, 0.0), run)
    assert shown.closest_s() == pytest.approx(look(item).closest_s)
    assert shown.row(1e3) == len(run.q) - 1


# ------------------------------------------------------------------ time
def test_work_that_plans_have_in_common_is_counted_once():
    one = headline_of(lambda unit: [GOOD])
    found = times.times([one, one])
    assert found["conditions"] == 2 * (len(headline.PLANNERS) + 1)
    assert found["ms_per_condition"]["1"][OURS] == 2000.0
    assert found["core_hours"] == pytest.approx(
        2 * 2.0 * (len(headline.PLANNERS) + 1) / 3600.0, abs=1e-3
    )
    assert f"| `{OURS}` | – | 2000 |" in "\n".join(times.lines(found))


# ------------------------------------------------------------------ people
def test_motions_that_leave_the_goal_again_are_counted():
    def outcome(unit):
        gone = unit.planner == people.COMPARED[0] and unit.task
        return [replace(GOOD, hold_error=0.02 if gone else 1e-4)]

    plans = people.people_plans(Scope((0,), smoke=True))
    text = "\n".join(people.people_lines({n: measured(p, outcome) for n, p in plans.items()}))
    rows = [line for line in text.splitlines() if line.startswith("| as drawn")]
    assert [row.split("|")[-4].strip() for row in rows] == 2 * ["50.0 %", "0.0 %", "0.0 %"]
    said = [line for line in text.splitlines() if line.startswith("- ")]
    assert said == ["- person changes target: the person goes to another target in mid-reach."]
