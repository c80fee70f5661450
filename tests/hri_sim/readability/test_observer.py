"""People read where a robot is going: rightly when it is plain, later when it is not."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hri_prediction.errors import ConfigError, DataError
from hri_sim.readability.observer import RESTS_S, Decision, Observer
from hri_sim.readability.traits import (
    KINDS,
    Traits,
    draw_other_traits,
    draw_person,
    draw_traits,
)

START = np.array((0.39, 0.0, 0.33))
GOALS = np.array(((0.56, 0.24, 0.12), (0.62, 0.0, 0.12), (0.56, -0.24, 0.12)))
SHARP: dict[str, Any] = {"noise": 0.0, "reaction_spread": 0.0}
DT = 0.008


def watched(
    traits: Traits, goal: int, seed: int = 0, duration: float = 2.5, rest: float = 1.0
) -> Decision | None:
    """What is made of a straight minimum-jerk motion, which rests at its end."""
    observer = Observer(traits, START, GOALS, np.random.default_rng(seed))
    for time in np.arange(0.0, duration + rest, DT):
        u = min(time / duration, 1.0)
        way = u**3 * (10.0 + u * (-15.0 + 6.0 * u))
        observer.watch(float(time), START + way * (GOALS[goal] - START))
    return observer.decision


def certain(decision: Decision | None) -> Decision:
    assert decision is not None
    return decision


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("goal", range(3))
def test_straight_motions_are_read_rightly_before_they_end(kind: str, goal: int) -> None:
    decision = certain(watched(Traits(kind=kind, **SHARP), goal))
    assert decision.goal == goal
    assert 0.2 < decision.sure_s < 2.3
    assert decision.shown_s == pytest.approx(decision.sure_s + 0.25)


@pytest.mark.parametrize("kind", KINDS)
def test_most_noisy_readings_are_right_too(kind: str) -> None:
    traits = Traits(kind=kind, noise=0.01, threshold=0.95)
    right = [certain(watched(traits, k % 3, seed=k)).goal == k % 3 for k in range(30)]
    assert np.mean(right) > 0.7


@pytest.mark.parametrize("kind", KINDS)
def test_motions_that_part_sooner_are_read_sooner(kind: str) -> None:
    traits = Traits(kind=kind, **SHARP)
    fast, slow = (certain(watched(traits, 0, duration=d)) for d in (1.5, 4.0))
    assert fast.sure_s < slow.sure_s

    def bowed(side: float) -> Decision | None:
        observer = Observer(traits, START, GOALS, np.random.default_rng(0))
        for time in np.arange(0.0, 3.5, DT):
            u = min(time / 2.5, 1.0)
            way = u**3 * (10.0 + u * (-15.0 + 6.0 * u))
            bow = side * np.array((0.0, 1.0, 0.0)) * (way * (1.0 - way))
            observer.watch(float(time), START + way * (GOALS[0] - START) + bow)
        return observer.decision

    exaggerated, misleading = certain(bowed(0.4)), certain(bowed(-0.8))
    assert exaggerated.goal == 0
    assert exaggerated.sure_s < certain(watched(traits, 0)).sure_s
    assert misleading.goal != 0 or misleading.sure_s > exaggerated.sure_s + 0.3


@pytest.mark.parametrize("kind", KINDS)
def test_who_expects_a_goal_reads_it_sooner_and_others_later(kind: str) -> None:
    neutral = Traits(kind=kind, **SHARP)
    biased = replace(neutral, prior=(1.5, 0.0, 0.0))
    for goal, sooner in ((0, True), (2, False)):
        usual, own = certain(watched(neutral, goal)), certain(watched(biased, goal))
        assert own.goal == goal
        assert (own.sure_s < usual.sure_s) == sooner
    convinced = replace(neutral, prior=(30.0, 0.0, 0.0))
    assert certain(watched(convinced, 2)).goal == 0, "whatever there is to be seen"


@pytest.mark.parametrize("kind", KINDS)
def test_who_wants_to_be_surer_takes_longer(kind: str) -> None:
    times = [
        certain(watched(Traits(kind=kind, threshold=threshold, **SHARP), 0)).sure_s
        for threshold in (0.5, 0.7, 0.9, 0.99)
    ]
    assert (np.diff(times) > 0.0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_sureness_must_last(kind: str) -> None:
    held = [
        certain(watched(Traits(kind=kind, hold=hold, **SHARP), 0)).sure_s
        for hold in (0.0, 0.1, 0.3)
    ]
    assert held[1] - held[0] == pytest.approx(0.1, abs=2 * DT)
    assert held[2] - held[0] == pytest.approx(0.3, abs=2 * DT)


def test_what_does_not_last_is_no_decision() -> None:
    """The tool is on its way to one goal for less than the hold, then to another."""
    observer = Observer(Traits(hold=0.2, rationality=100.0, **SHARP), START, GOALS, _rng())
    for step in range(400):
        aim = GOALS[0] if step % 40 < 20 else GOALS[2]
        assert observer.watch(step * DT, START + 0.3 * (aim - START)) is None
        assert observer.probabilities.max() > 0.85


def _rng() -> np.random.Generator:
    return np.random.default_rng(0)


@settings(max_examples=100, deadline=None)
@given(tool=arrays(float, 3, elements=st.floats(-1.0, 1.0)), k=st.floats(0.1, 100.0),
       prior=arrays(float, 3, elements=st.floats(-3.0, 3.0)))  # fmt: skip
def test_probabilities_are_those_of_dragan_and_srinivasa(tool, k, prior) -> None:
    traits = Traits(rationality=k, prior=tuple(prior), **SHARP)
    observer = Observer(traits, START, GOALS, _rng())
    before = np.exp(prior - np.log(np.sum(np.exp(prior))))
    np.testing.assert_allclose(observer.probabilities, before)
    observer.watch(0.0, tool)
    nearer = np.linalg.norm(GOALS - START, axis=1) - np.linalg.norm(GOALS - tool, axis=1)
    scores = before * np.exp(k * nearer - np.max(k * nearer))
    np.testing.assert_allclose(observer.probabilities, scores / scores.sum(), atol=1e-9)
    assert observer.probabilities.sum() == pytest.approx(1.0)


def test_headings_are_forgotten() -> None:
    """Straight at a goal, then at rest: after a while nothing speaks for it."""
    observer = Observer(Traits(kind="heading", threshold=0.9999, **SHARP), START, GOALS, _rng())
    for step in range(40):
        observer.watch(step * DT, START + 0.004 * step * (GOALS[0] - START))
    likely = observer.probabilities[0]
    again = Observer(
        Traits(kind="heading", threshold=0.9999, forgetting=0.05, **SHARP), START, GOALS, _rng()
    )
    for step in range(40):
        again.watch(step * DT, START + 0.004 * step * (GOALS[0] - START))
    assert likely > again.probabilities[0] > 1.0 / 3.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("goal", range(3))
def test_a_robot_that_has_come_to_rest_is_read_by_where_it_is(kind: str, goal: int) -> None:
    """By somebody whom nothing on the way convinces."""
    blind = Traits(kind=kind, rationality=0.1, attention=0.1, **SHARP)
    decision = certain(watched(blind, goal))
    assert decision.goal == goal
    assert 2.2 < decision.sure_s - RESTS_S < 2.6


def test_a_robot_that_has_not_begun_is_not_read() -> None:
    observer = Observer(Traits(prior=(30.0, 0.0, 0.0), **SHARP), START, GOALS, _rng())
    for step in range(500):
        assert observer.watch(step * DT, START + 0.003 * np.sin(step) * np.array((1, 0, 0))) is None


def test_a_tool_that_is_not_seen_is_not_looked_at() -> None:
    traits = Traits(**SHARP)
    plain, gaps = (Observer(traits, START, GOALS, _rng()) for _ in range(2))
    for time in np.arange(0.0, 2.5, DT):
        at = START + time / 2.5 * (GOALS[2] - START)
        for bad in (at * np.nan, np.array((np.inf, 0.0, 0.0))):
            assert gaps.watch(float(time) - 0.5 * DT, bad) == gaps.decision
        gaps.watch(float(time), at)
        plain.watch(float(time), at)
        np.testing.assert_array_equal(gaps.probabilities, plain.probabilities)
    assert certain(gaps.decision) == certain(plain.decision)


def test_what_was_decided_stays_and_earlier_times_are_not_looked_at() -> None:
    observer = Observer(Traits(**SHARP), START, GOALS, _rng())
    for step in range(400):
        observer.watch(step * DT, START + min(step / 300, 1.0) * (GOALS[0] - START))
    first = certain(observer.decision)
    assert first.goal == 0
    for step in range(400, 800):
        assert observer.watch(step * DT, GOALS[2]) is first
    other = Observer(Traits(**SHARP), START, GOALS, _rng())
    other.watch(1.0, START + 0.1)
    before = other.probabilities
    other.watch(0.5, GOALS[2])
    other.watch(1.0, GOALS[2])
    np.testing.assert_array_equal(other.probabilities, before)


def test_the_same_seed_sees_the_same() -> None:
    traits = Traits(noise=0.02)
    assert watched(traits, 0, seed=3) == watched(traits, 0, seed=3)
    assert watched(traits, 0, seed=3) != watched(traits, 0, seed=4)


def test_noise_wanders_as_much_as_it_is_said_to() -> None:
    """Of the tool at the start, the bayesian's evidence tells where it seems to be."""
    traits = Traits(noise=0.02, noise_time=0.1)
    observer = Observer(traits, START, GOALS, _rng())
    seen = []
    for step in range(20000):
        observer.watch(step * DT, START)
        assert observer._seen is not None
        seen.append(observer._seen - START)
    noise = np.array(seen)
    assert noise.std() == pytest.approx(0.02, rel=0.1)
    later = round(0.1 / DT)
    alike = np.mean(noise[later:] * noise[:-later]) / np.mean(noise**2)
    assert alike == pytest.approx(np.exp(-later * DT / 0.1), abs=0.1)


def test_reactions_are_log_normal() -> None:
    traits = Traits(noise=0.0, reaction=0.3, reaction_spread=0.2)
    found = np.array([certain(watched(traits, 0, seed=k, rest=0.0)) for k in range(120)])
    logs = np.log([d.shown_s - d.sure_s for d in found])
    assert np.mean(logs) == pytest.approx(np.log(0.3), abs=0.06)
    assert np.std(logs) == pytest.approx(0.2, abs=0.05)


@pytest.mark.parametrize("prior", [(0.0,), (0.0, 1.0), (0.0,) * 4])
def test_priors_are_of_each_goal(prior: tuple[float, ...]) -> None:
    with pytest.raises(DataError, match=f"prior of {len(prior)} goals; expected 3, one for each"):
        Observer(Traits(prior=prior), START, GOALS, _rng())


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"kind": "clever"}, "kind = 'clever'; expected one of bayesian, heading"),
        ({"threshold": 1.0}, r"threshold = 1\.0"),
        ({"threshold": 0.1}, r"threshold = 0\.1"),
        ({"noise": -0.1}, r"noise = -0\.1"),
        ({"hold": np.nan}, "hold = nan"),
        ({"prior": (0.0, np.nan)}, "prior = "),
        ({"hand_speed": 0.0}, r"hand_speed = 0\.0"),
    ],
)
def test_traits_that_nobody_has_are_refused(changes: dict[str, Any], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        Traits(**changes)


def test_people_differ_and_others_are_unlike_them() -> None:
    people = [draw_traits(np.random.default_rng(k), 3) for k in range(40)]
    others = [draw_other_traits(np.random.default_rng(k), 3) for k in range(40)]
    assert draw_traits(np.random.default_rng(5), 3) == people[5]
    assert len(set(people)) == 40
    assert {p.kind for p in people} == {"bayesian"}
    assert {p.kind for p in others} == {"heading"}
    for name in ("noise", "reaction", "reaction_spread"):
        assert np.mean([getattr(o, name) for o in others]) > np.mean(
            [getattr(p, name) for p in people]
        )
    assert all(len(p.prior) == 3 for p in (*people, *others))
    assert draw_person("usual", np.random.default_rng(5), 3) == people[5]
    assert draw_person("other", np.random.default_rng(5), 3) == others[5]
    with pytest.raises(ConfigError, match="people 'clever'; expected usual or other"):
        draw_person("clever", _rng(), 3)
