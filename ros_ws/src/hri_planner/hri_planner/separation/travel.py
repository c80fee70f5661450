"""The protective distance of a part of the robot and one of a person, and what speed it allows: compiled.

Everything is measured along one direction, from the nearest point of the person's part to the nearest of
the robot's. As parts are convex, there is a plane across that direction between them with all of the gap
in front of the robot's; as long as neither crosses its side of the gap they cannot touch, wherever else
they move. What moves farthest along a direction is one of the ends of a segment, so that ends are all
that is looked at.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hri_prediction.compiled import njit

ASSUMED_MODE, MEASURED_MODE, PREDICTED_MODE = 0, 1, 2

# Places of the terms in a row of results.
S_H, S_R, S_S, ROBOT_SPEED, HUMAN_SPEED = 0, 1, 2, 3, 4
TERMS = 5

# Places in the vector of parameters.
(
    REACTION, STOPPING, SETTLING, ROBOT_ACCELERATION, START_SPEED, FIXED, HUMAN_ACCELERATION,
    SPEED_ERROR, NOISE, SIGMAS, EVASION, CONTACT_SPEED, ROBOT_AGE,
) = range(13)  # fmt: skip
PARAMETERS = 13

SLOWEST_SEEN = 0.1
"""At a lower rate the robot's measured speed says too little of what it would be at full rate."""
AWAY = -0.02
"""A part that is faster than that away from somebody evades them [m/s]."""
_HALVINGS = 10  # of the allowed scale: to a thousandth


@njit
def robot_travel(
    toward: float, rate: float, path_speed: float, scale: float, par: Any, terms: Any
) -> float:
    """How far a part comes towards the person if it is stopped a reaction time from now: S_r + S_s.

    Args:
        toward: Speed of its faster end towards the person now [m/s].
        rate: The least rate behind that speed, 0...1: the arm follows late.
        path_speed: Of the fastest point of the path now, at full rate [m/s]; below 0: not known.
        scale: Rate that it is given.
        par: Parameters.
        terms: Gets S_r, S_s and the speed at that rate.
    """
    if rate >= SLOWEST_SEEN:
        speed = toward * scale / rate
    else:
        speed = max(toward, (path_speed if path_speed >= 0.0 else par[START_SPEED]) * scale)
    # At a rate the path is both slower and gone through more slowly.
    grown = par[ROBOT_ACCELERATION] * scale * scale
    # It has gone on since it was measured.
    reaction, stop = par[REACTION] + par[ROBOT_AGE], par[STOPPING] * scale
    at_stop = max(speed + grown * reaction, 0.0)
    # The rate falls linearly; what the path gains meanwhile falls with it.
    terms[S_R] = max(speed * reaction + 0.5 * grown * reaction * reaction, 0.0)
    terms[S_S] = at_stop * (0.5 * stop + par[SETTLING]) + grown * stop * stop / 6.0
    terms[ROBOT_SPEED] = speed
    return terms[S_R] + terms[S_S]


@njit
def human_travel(
    seconds: float,
    ends: Any,
    ages: Any,
    speeds: Any,
    spreads: Any,
    half_window: float,
    fastest: float,
    mode: int,
    outward: Any,
    times: Any,
    mean: Any,
    covariance: Any,
    ahead: Any,
    par: Any,
    terms: Any,
) -> float:
    """How far a part comes towards the robot until it rests: S_h.

    No part is taken to become faster than is assumed; one that is seen to be faster already, by more than
    the error of what is seen, goes on at least as fast as it is for certain.

    Args:
        seconds: From now until the robot rests [s].
        ends: Of the part, as seen last (2, 3) [m].
        ages: How long ago that was (2,) [s].
        speeds: Their velocities as measured (2, 3) [m/s]; NaN where they are not known.
        spreads: Standard deviations of these per metre of noise in the samples (2,) [1/s].
        half_window: How much older than the places the velocities are [s].
        fastest: Speed that is assumed [m/s].
        mode: ASSUMED_MODE and so on.
        outward: Unit vector towards the robot (3,).
        times: Of the predicted instants, from its newest sample on (k,) [s].
        mean: Predicted places of the ends (2, k, 3) [m].
        covariance: Of these (2, k, 3, 3) [m²].
        ahead: How much older than the ends' samples the prediction's is (2,) [s].
        par: Parameters.
        terms: Gets S_h and the mean speed behind it.
    """
    farthest, speed = 0.0, 0.0
    for end in range(2):
        span = seconds + ages[end]
        error = max(par[SPEED_ERROR], par[NOISE] * spreads[end])
        seen = 0.0
        for k in range(3):
            seen += speeds[end, k] * outward[k]
        directed = seen + error
        way = fastest * span
        if mode != ASSUMED_MODE and seen - error > fastest:
            way = (seen - error) * span
        if mode != ASSUMED_MODE and not math.isnan(directed):  # else too few samples for a speed
            # The measured speed is that of the middle of the window.
            gained = par[HUMAN_ACCELERATION] * span * (half_window + 0.5 * span)
            going = directed * span + gained
            if mode == PREDICTED_MODE:
                # Who is predicted to slow down may speed up all the same: a prediction only makes it surer
                # how fast they are.
                predicted = _predicted(
                    span, ahead[end], half_window, ends[end], outward, times, mean[end],
                    covariance[end], par,
                )  # fmt: skip
                going = max(predicted, seen * span + gained, directed * span)
            way = min(way, max(going, 0.0))
        if math.isnan(way):
            terms[S_H] = terms[HUMAN_SPEED] = math.nan
            return math.nan
        if way > farthest:
            farthest = way
            speed = way / span if span > 0.0 else 0.0
    terms[S_H], terms[HUMAN_SPEED] = farthest, speed
    return farthest


@njit
def instant_of(times: Any, at: float) -> tuple[int, float]:
    """The predicted instant before a time, and the share of the way to the next at which it is.

    Args:
        times: Of the predicted instants (k,) [s], k > 1; what is -inf comes after them.
        at: The time [s]; before the first instant that counts, after the last one the last.
    """
    index = 0
    last = len(times) - 1
    while index + 1 < last and times[index + 1] <= at and times[index + 2] > times[index + 1]:
        index += 1
    step = times[index + 1] - times[index]
    return index, min(max((at - times[index]) / step, 0.0), 1.0)


@njit
def _predicted(
    span: float,
    ahead: float,
    half_window: float,
    place: Any,
    outward: Any,
    times: Any,
    mean: Any,
    covariance: Any,
    par: Any,
) -> float:
    """How far a place may come within a time, by what is predicted [m].

    With the spread that is reckoned with, and what people may do otherwise than predicted: what they began
    after the middle of the samples that they were seen by, with an acceleration of their own.
    """
    # A place that was not seen in the newest sample is told there by the others: that is no sight of it.
    horizon, unseen = span + ahead, max(-ahead, 0.0)
    # Whoever is nearer than they are predicted to be by now goes on from where they are.
    farthest, nearer = 0.0, 0.0
    index, share = instant_of(times, ahead)
    for k in range(3):
        now = mean[index, k] + share * (mean[index + 1, k] - mean[index, k])
        nearer += (place[k] - now) * outward[k]
    nearer = max(nearer, 0.0)
    for index in range(len(times)):
        way, spread = nearer, 0.0
        # The last instant is the horizon itself, which lies between two that are predicted.
        back = 0.0
        if index > 0 and times[index] > horizon:
            back = min((times[index] - horizon) / (times[index] - times[index - 1]), 1.0)
        for k in range(3):
            at = mean[index, k]
            if back > 0.0:
                at -= back * (at - mean[index - 1, k])
            way += (at - place[k]) * outward[k]
            for m in range(3):
                both = covariance[index, k, m]
                if back > 0.0:
                    both -= back * (both - covariance[index - 1, k, m])
                spread += outward[k] * both * outward[m]
        until = max(min(times[index], horizon) + unseen, 0.0)
        own = par[HUMAN_ACCELERATION] * until * (half_window + 0.5 * until)
        farthest = max(farthest, way + par[SIGMAS] * math.sqrt(max(spread, 0.0)) + own)
        if times[index] >= horizon:
            return farthest
    return np.inf  # it does not reach that far


@njit
def allowed_scale(
    distance: float,
    toward: float,
    rate: float,
    path_speed: float,
    ends: Any,
    ages: Any,
    speeds: Any,
    spreads: Any,
    half_window: float,
    fastest: float,
    mode: int,
    outward: Any,
    times: Any,
    mean: Any,
    covariance: Any,
    ahead: Any,
    par: Any,
    terms: Any,
) -> float:
    """Largest rate for which the protective distance is no more than the distance; 0 when there is none.

    Each rate is judged as if the robot had it already. While it slows down to it, the person comes
    nearer, and the allowed rate falls on; but never as fast as the robot can slow down, since the
    protective distance falls with the rate by at least what both come nearer during that much of the ramp.

    With evasion, of a part that moves away, what the person does is left out: it is only to have room for
    its own way back, should it turn round.

    The arguments are those of :func:`robot_travel` and :func:`human_travel`.
    """
    if math.isnan(distance) or math.isnan(toward) or math.isnan(rate) or math.isnan(path_speed):
        return 0.0
    evades = par[EVASION] > 0.0 and toward < AWAY
    low, high = 0.0, 1.0
    scale = 1.0
    for halving in range(_HALVINGS + 1):
        seconds = par[REACTION] + par[STOPPING] * scale + par[SETTLING]
        needed = robot_travel(toward, rate, path_speed, scale, par, terms) + par[FIXED]
        if not evades:
            needed += human_travel(
                seconds, ends, ages, speeds, spreads, half_window, fastest, mode, outward, times, mean,
                covariance, ahead, par, terms,
            )  # fmt: skip
        if needed <= distance:
            if halving == 0:
                return 1.0
            low = scale
        else:
            high = scale
        scale = 0.5 * (low + high)
    return low


@njit
def harmless_scale(speed: float, rate: float, path_speed: float, par: Any) -> float:
    """Largest rate at which no point of the robot gets faster than is harmless before it is seen again.

    A slow robot may be about to become fast: until a change of the rate has its effect, its points gain
    speed, the more the higher the rate is.

    Args:
        speed: Of the fastest point now [m/s].
        rate: The least rate behind that speed, 0...1: the arm follows late.
        path_speed: Of the fastest point of the path now, at full rate [m/s]; below 0: not known. Of a path
            that is fast the harmless rate is so low that measured speeds say nothing of it.
        par: Parameters.
    """
    contact = par[CONTACT_SPEED]
    if not contact > 0.0 or math.isnan(speed) or math.isnan(rate) or math.isnan(path_speed):
        return 0.0
    if rate >= SLOWEST_SEEN:
        full = max(speed / rate, path_speed)
    else:
        full = max(speed, path_speed if path_speed >= 0.0 else par[START_SPEED])
    low, high, scale = 0.0, 1.0, 1.0
    for halving in range(_HALVINGS + 1):
        seconds = par[REACTION] + par[ROBOT_AGE] + 0.5 * par[STOPPING] * scale
        if scale * (full + par[ROBOT_ACCELERATION] * scale * seconds) <= contact:
            if halving == 0:
                return 1.0
            low = scale
        else:
            high = scale
        scale = 0.5 * (low + high)
    return low
