"""Reaches from rest to rest of which nobody knows exactly when they begin and end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drawn import ALPHA, RATE_HZ, optimum, problem, recorded

from hri_prediction.errors import DataError
from hri_prediction.motor_control.costs import CHAPTER_2
from hri_prediction.motor_control.law import WeightLaw, explained, fit_law, mean_postures
from hri_prediction.motor_control.observed import of_angles
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.span import fitted_span, span_derivatives, within
from hri_prediction.motor_control.whole import REST_S, observe_whole

FACING = 0.5 * np.pi


def seen_with_rest(solver, motion, task, begin, end, rng=None, noise=0.0):
    """The path of a motion, with rest before and after, and errors of its angles."""
    length = task.duration / (end - begin)
    phases = np.linspace(0.0, 1.0, round(length * RATE_HZ) + 1)
    angles = motion.angles(within(phases, (begin, end)))
    if noise:
        angles = angles + rng.normal(0.0, noise, angles.shape)
    whole = ReachProblem.at_rest(task.q_start, task.q_end, length)
    return of_angles(whole, angles, solver.arm)


def test_derivatives_of_a_path_by_its_span_match_finite_differences(solver):
    task = problem(13)
    motion, _ = optimum(solver, task, ALPHA)
    seen = seen_with_rest(solver, motion, task, 0.1, 0.9)
    span, step = (0.12, 0.87), 1e-6
    found = span_derivatives(motion, seen, solver.arm, span)
    for index in range(2):
        ahead, behind = (
            motion.hand(
                within(
                    seen.phases, tuple(s + sign * step * (i == index) for i, s in enumerate(span))
                ),
                solver.arm,
            )
            for sign in (1.0, -1.0)
        )
        np.testing.assert_allclose(
            found[:, index], ((ahead - behind) / (2 * step)).ravel(), atol=1e-5
        )


@pytest.mark.parametrize("off", [(0.04, 0.03), (-0.05, -0.04), (0.06, -0.06)])
def test_spans_are_found_again(solver, off):
    task = problem(40)
    motion, _ = optimum(solver, task, ALPHA)
    seen = seen_with_rest(solver, motion, task, 0.11, 0.88)
    found = fitted_span(motion, seen, solver.arm, (0.11 + off[0], 0.88 + off[1]))
    np.testing.assert_allclose(found, (0.11, 0.88), atol=1e-5)


def test_a_law_is_found_where_nobody_knows_when_reaches_begin(solver, rng):
    """Beside the same with begins and ends that are a few hundredths of a second off."""
    theta = np.zeros((3, 7))
    theta[:, 0] = (-0.3, -1.0, -0.6)
    theta[:, 1:] = rng.normal(0.0, 0.5, (3, 6))
    law = WeightLaw(CHAPTER_2, theta)
    reaches, spans, cut, truth = [], [], [], []
    for number in range(0, 81, 4):
        task = problem(number)
        alpha = law.alpha(task.q_start, task.q_end)
        motion, _ = optimum(solver, task, alpha)
        seen = seen_with_rest(solver, motion, task, 0.1, 0.9)
        wrong = rng.normal((0.1, 0.9), 0.015)
        reaches.append(seen)
        spans.append(tuple(wrong))
        inside = (seen.phases >= wrong[0]) & (seen.phases <= wrong[1])
        length = (wrong[1] - wrong[0]) * seen.problem.duration
        moved = ReachProblem.at_rest(task.q_start, task.q_end, length)
        cut.append(of_angles(moved, seen.angles[inside], solver.arm))
        truth.append(alpha)

    def share(of, **options):
        fitted = fit_law(lambda _: solver, of, **options)
        assert np.isfinite(fitted.theta_sd).all()
        ends = mean_postures(of, range(len(of)))
        return explained(truth, [fitted.law.alpha(*each) for each in ends])

    found, taken = share(reaches, spans=spans), share(cut)
    print(f"explained {found:.3f} with spans, {taken:.3f} with begins and ends as they were taken")
    assert found > 0.99
    assert taken < 0.7
    with pytest.raises(DataError, match="2 spans of"):
        fit_law(lambda _: solver, reaches, spans=spans[:2])


def test_nothing_is_said_to_be_known_of_what_reaches_do_not_show(solver):
    """All of them begin in one posture and end in another: slopes by posture cannot be told apart."""
    motion, _ = optimum(solver, problem(5), ALPHA)
    seen = seen_with_rest(solver, motion, problem(5), 0.1, 0.9)
    fitted = fit_law(lambda _: solver, [seen] * 3, spans=[(0.1, 0.9)] * 3, steps=3)
    assert np.isinf(fitted.theta_sd).all()


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(("noise", "off_s"), [(0.0, 0.04), (0.003, 0.07)])
def test_begin_and_end_are_found_in_recordings(solver, rng, noise, off_s, side):
    for number in (0, 30, 60):
        track, onset, end = recorded(solver, number, rng, noise=noise, side=side)
        whole = observe_whole(track, onset + 0.1, end - 0.15, solver.arm, facing_rad=FACING)
        length = (whole.span[1] - whole.span[0]) * whole.seen.problem.duration
        assert whole.begin_s == pytest.approx(onset, abs=off_s)
        assert whole.begin_s + length == pytest.approx(end, abs=off_s)
        assert whole.span[0] * whole.seen.problem.duration == pytest.approx(REST_S, abs=0.01)
        assert whole.between.problem.duration == pytest.approx(length, abs=0.01)
        task = problem(number)
        np.testing.assert_allclose(whole.seen.problem.q_start, task.q_start, atol=0.02)
        np.testing.assert_allclose(whole.seen.problem.q_end, task.q_end, atol=0.02)
        assert not whole.between.problem.v_start.any()


def test_what_comes_right_after_a_reach_is_not_looked_at(solver, rng):
    """There, and back again at once: the hand rests for a moment."""
    track, onset, end = recorded(solver, 30, rng)
    inside = (track.time_s >= onset) & (track.time_s <= end)
    there = track.keypoints[inside]
    points = np.concatenate([track.keypoints[track.time_s < onset], there, there[::-1]])
    both = replace(track, time_s=np.arange(len(points)) / RATE_HZ, keypoints=points)
    whole = observe_whole(both, onset, end, solver.arm, facing_rad=FACING)
    length = whole.seen.problem.duration
    assert whole.begin_s + (1.0 - whole.span[0]) * length < end + REST_S + 0.03
    moved = np.linalg.norm(whole.seen.hand[-1] - whole.seen.hand, axis=1)
    assert moved[whole.seen.phases > whole.span[1]].max() < 0.01


def test_no_rest_is_no_whole_reach(solver, rng):
    track, onset, end = recorded(solver, 3, rng)

    def part(first, last):
        inside = (track.time_s >= first) & (track.time_s <= last)
        return replace(track, time_s=track.time_s[inside], keypoints=track.keypoints[inside])

    def look(at, until):
        observe_whole(at, onset, until, solver.arm, facing_rad=FACING)

    with pytest.raises(DataError, match=r"s of rest are seen after it.*leave out --whole"):
        look(part(0.0, end - 0.05), end - 0.05)
    with pytest.raises(DataError, match=r"s of rest are seen before it.*record longer"):
        look(part(onset, 9.0), end)
    middle = onset + 0.5 * (end - onset)
    with pytest.raises(DataError, match=r"after it the hand is never slower than \d+%.*rest"):
        look(part(0.0, middle), middle)
    with pytest.raises(DataError, match="with a gap of"):
        look(part(0.0, middle), end)
    still = np.repeat(track.keypoints[:1], len(track.time_s), axis=0)
    with pytest.raises(DataError, match="the reach has no length"):
        look(replace(track, keypoints=still), end)
    with pytest.raises(DataError, match="nothing is seen"):
        observe_whole(track, 50.0, 51.0, solver.arm, facing_rad=FACING)


@pytest.mark.parametrize("hidden_s", [(0.33, 0.0), (0.0, 0.33)])
def test_rest_that_was_not_seen_is_no_rest(solver, rng, hidden_s):
    """Times are those of samples, also where the arm is first seen a little after a reach's label."""
    track, onset, end = recorded(solver, 13, rng)
    whole = observe_whole(track, onset, end, solver.arm, facing_rad=FACING)
    seen = (track.time_s >= hidden_s[0]) & (track.time_s <= track.time_s[-1] - hidden_s[1])
    points = np.where(seen[:, None, None], track.keypoints, np.nan)
    part = replace(track, keypoints=points)
    # Labels are off by less than what gaps may be.
    found = observe_whole(
        part, onset - 0.08 * (hidden_s[0] > 0.0), end + 0.08 * (hidden_s[1] > 0.0), solver.arm,
        facing_rad=FACING,
    )  # fmt: skip
    assert found.begin_s == pytest.approx(whole.begin_s, abs=0.01)
    length = found.seen.problem.duration
    known = track.time_s[seen]
    begin = found.begin_s - found.span[0] * length
    assert begin >= known[0] - 1e-6
    assert begin + length <= known[-1] + 1e-6
