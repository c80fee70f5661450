"""Varied conditions: what differs, and only that, the same each time."""

import json
from dataclasses import replace

import numpy as np
import pytest

from hri_prediction.errors import ConfigError
from hri_sim.benchmark import command, workers
from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.episode import run_episode
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.observers import OBSERVERS
from hri_sim.benchmark.outcome import Outcome
from hri_sim.benchmark.planners import NOMINAL, PLANNERS
from hri_sim.benchmark.report import report
from hri_sim.benchmark.rows import RowFile
from hri_sim.benchmark.run import Plan, marks, run_benchmark
from hri_sim.benchmark.variation import (
    AS_DRAWN,
    CHANGES_TARGET,
    MAX_LATENCY_MS,
    STOPS,
    Variation,
)
from hri_sim.benchmark.watching import Watch

TIMES = np.linspace(-0.5, 4.0, 100)
SMALL = Plan((PLANNERS[NOMINAL],), "tuning", 1.0, (0,), (0,), 2)


@pytest.fixture(scope="module")
def condition():
    return task_conditions("tuning", 0).conditions[0]


def test_nothing_differs_by_default(condition):
    person = AS_DRAWN.person_in(condition)
    assert person.spec == condition.scenario.persons[0]
    np.testing.assert_array_equal(person.truth(TIMES), condition.person().truth(TIMES))
    assert AS_DRAWN.text == "none"


def test_tracking_differs_and_nothing_else(condition):
    variation = Variation(tracking_noise_mm=10.0, latency_ms=90.0)
    person = variation.person_in(condition)
    assert (person.spec.noise_sd, person.spec.latency) == pytest.approx((0.01, 0.09))
    np.testing.assert_array_equal(person.truth(TIMES), condition.person().truth(TIMES))
    assert variation.text == "tracking noise of 10 mm, tracking 90 ms late"


def test_who_is_faster_than_learnt_takes_less_time_for_the_same_way(condition):
    (usual,), (fast,) = (
        person.motions
        for person in (condition.person(), Variation(person_speed=1.5).person_in(condition))
    )
    assert fast.duration == pytest.approx(usual.duration / 1.5)
    assert fast.start_s == usual.start_s
    assert np.linalg.norm(fast.end - usual.end) < 0.05


@pytest.mark.parametrize("number", [0, 4])
def test_who_changes_target_ends_at_another_one_of_the_task_if_it_has_several(number):
    for condition in task_conditions("tuning", number).conditions[:5]:
        person = Variation(person=CHANGES_TARGET).person_in(condition)
        again = Variation(person=CHANGES_TARGET).person_in(condition)
        np.testing.assert_array_equal(person.truth(TIMES), again.truth(TIMES))
        end, targets = person.motions[0].end, condition.task.targets
        meant = targets[condition.scenario.reaches[0].person_target]
        others = [place for place in targets.values() if place != meant]
        assert np.linalg.norm(end - meant) > 0.05
        if others:
            assert min(np.linalg.norm(end - np.array(other)) for other in others) < 0.08
        begun = person.motions[0].start_s > TIMES
        usual = condition.person().truth(TIMES)
        np.testing.assert_array_equal(person.truth(TIMES)[begun], usual[begun])


def test_who_stops_does_not_get_there(condition):
    person = Variation(person=STOPS).person_in(condition)
    (usual,), (stopped,) = condition.person().motions, person.motions
    assert stopped.end_s < usual.end_s
    assert np.linalg.norm(stopped.end - usual.end) > 0.03


def test_planners_meet_the_varied_person(condition):
    """The nominal motion collides with the person as drawn; noise means nothing to it."""
    library = task_library("tuning", 0)
    nominal = PLANNERS[NOMINAL]

    def clearance(variation):
        outcome = run_episode(
            condition, nominal, library, slowdown=1.0, seed=0, variation=variation
        )
        return outcome.clearance

    usual = clearance(AS_DRAWN)
    assert clearance(Variation(tracking_noise_mm=20.0)) == usual
    assert clearance(Variation(person_speed=0.5)) != usual
    noisy, still = (
        run_episode(
            condition,
            PLANNERS["ptomp_staying"],
            library,
            slowdown=512.0,
            seed=0,
            variation=variation,
        )
        for variation in (Variation(tracking_noise_mm=20.0), AS_DRAWN)
    )
    assert noisy != still


def test_resuming_never_mixes_variations(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "compile_kernels", lambda: None)
    varied = replace(SMALL, variation=Variation(person_speed=1.5))
    executed = replace(SMALL, execution="mujoco")
    ours = marks(SMALL)
    for other in (varied, executed, replace(SMALL, variation=Variation(latency_ms=8.0))):
        assert all(mark != ours[name] for name, mark in marks(other).items())
    run_benchmark(replace(SMALL, planners=()), tmp_path / "rows.jsonl")
    file = RowFile(tmp_path / "rows.jsonl", marks(varied), Outcome)
    assert len(RowFile(tmp_path / "rows.jsonl", ours, Outcome).read()) == 1
    assert file.read() == {}


def test_results_say_what_differs(tmp_path, monkeypatch):
    options = ("--smoke", "--split", "tuning", "--planners", NOMINAL, "--workers", "1")
    varied = ("--person", STOPS, "--person-speed", "1.5", "--latency-ms", "50")
    monkeypatch.setattr(workers, "compile_kernels", lambda: None)
    texts = []
    for name, more in (("usual", ()), ("varied", varied)):
        out = tmp_path / name
        monkeypatch.setattr("sys.argv", ["script", "--out", str(out), *options, *more])
        with pytest.raises(SystemExit):
            command.main()
        results = json.loads((out / "results.json").read_text())
        texts.append(results["variation"])
        assert results["execution"] == "paper"
        said = f"Otherwise than drawn and learnt: {texts[-1]}" in (out / "results.md").read_text()
        assert said == (name == "varied")
        assert "Executed in MuJoCo" not in report(results)
    assert texts == [
        "none",
        "tracking 50 ms late, the person is 1.5 times as fast as it was learnt, "
        "the person stops in mid-reach and stays there",
    ]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"tracking_noise_mm": -1.0}, "0 to 100 mm"),
        ({"latency_ms": float("nan")}, "0 to 90 ms"),
        ({"person_speed": 0.0}, r"0\.25 to 4"),
        ({"person": "dances"}, "usual, stops, changes-target"),
    ],
)
def test_senseless_variations_are_refused(values, message):
    with pytest.raises(ConfigError, match=message):
        Variation(**values)


def test_the_predictor_still_knows_a_person_that_is_seen_as_late_as_may_be(condition):
    variation = Variation(latency_ms=MAX_LATENCY_MS)
    person = variation.person_in(condition)
    observer = OBSERVERS["promp"](person, task_library("tuning", 0))
    watch = Watch(person, observer, np.random.default_rng(0))
    begun = []
    for now in np.arange(30) / 28.0:
        watch.advance(now)
        (forecast,) = watch.known(1)
        begun.append(forecast.time0_s)
    # A forecast that is no longer valid would be kept, and grow old.
    assert np.abs(np.array(begun) - np.arange(30) / 28.0).max() < 0.1
