"""Move a hand with a learnt policy, at any control rate: no ROS, no robot.

A partner's hand crosses the way, and the goal moves in mid-flight. Prints the motion with and without
the filter that keeps the hand a distance from the partner's.

    scripts/_run_in_env python examples/steer_policy.py
    scripts/_run_in_env python examples/steer_policy.py --rate 1000 --separation 0.2 --plot out.png
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from hri_planner.policy.partner import Partner
from hri_planner.policy.runner import PolicyRunner
from hri_planner.policy.separation import SeparationConfig
from hri_planner.rnn.model_file import find_policy, load_policy
from hri_prediction.errors import DataError, HriError
from hri_prediction.geometry.minimum_jerk import minimum_jerk

START, GOAL, LATER_GOAL = (
    np.array(place) for place in ((0.45, -0.35, 0.25), (0.45, 0.25, 0.20), (0.45, 0.35, 0.35))
)
SWITCH_S = 1.2
PARTNER_FROM, PARTNER_TO = np.array((0.85, 0.05, 0.20)), np.array((0.45, 0.0, 0.22))
PARTNER_TAKES_S = 1.0
WAY_BACK_S = 1.5
SECONDS = 6.0


def partner_at(time_s: float) -> Partner:
    """Somebody who reaches into the way, and withdraws; the velocity by central differences."""

    def place(when: float) -> np.ndarray:
        there = minimum_jerk(when / PARTNER_TAKES_S) - minimum_jerk(
            (when - WAY_BACK_S) / PARTNER_TAKES_S
        )
        return PARTNER_FROM + float(there) * (PARTNER_TO - PARTNER_FROM)

    step = 1e-4
    velocity = (place(time_s + step) - place(time_s - step)) / (2.0 * step)
    return Partner(place(time_s), velocity)


def move(runner: PolicyRunner) -> tuple[np.ndarray, np.ndarray]:
    """Places of the hand, and its distances from the partner's, of each control step."""
    hand = runner.begin(START)
    places, distances = [], []
    for index in range(round(SECONDS / runner.period)):
        time_s = index * runner.period
        partner = partner_at(time_s)
        places.append(hand.position)
        distances.append(partner.distance(hand.position))
        hand = runner.step(hand, GOAL if time_s < SWITCH_S else LATER_GOAL, [partner])
    return np.array(places), np.array(distances)


def main() -> None:
    """Move a hand with and without the filter."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--policy", default="rnn_gru_9x9_d1", help="name or file of a policy")
    parser.add_argument("--rate", type=float, default=250.0, help="control steps a second [Hz]")
    parser.add_argument("--separation", type=float, default=0.15, help="kept by the filter [m]")
    parser.add_argument("--plot", metavar="PNG", help="draw paths and distances")
    options = parser.parse_args()

    if options.rate <= 0.0:
        raise DataError(f"--rate {options.rate}", expected="control steps a second, as 250")
    model = load_policy(find_policy(options.policy))
    filters = {"without": None, "with": SeparationConfig(separation=options.separation)}
    runners = {name: PolicyRunner(model, f, 1.0 / options.rate) for name, f in filters.items()}
    runs = {}
    print("filter   nearest to the partner  goal reached after  distance in the end")
    for name, runner in runners.items():
        places, distances = move(runner)
        away = np.linalg.norm(places - LATER_GOAL, axis=1)
        outside = np.flatnonzero(away > 0.03)
        reached = "-" if outside[-1] == len(away) - 1 else f"{outside[-1] * runner.period:.2f} s"
        nearest = f"{distances.min() * 1e3:.0f} mm"
        print(f"{name:<7} {nearest:>23}  {reached:>18}  {away[-1] * 1e3:16.1f} mm")
        runs[name] = places, distances, runner.period

    if options.plot:
        plot(runs, options.separation, options.plot)
        print(f"drawn: {options.plot}")


def plot(runs: dict, separation: float, path: str) -> None:
    """Paths from above, and distances from the partner over time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4.5), layout="constrained")
    above, over_time = figure.subplots(1, 2)
    for name, (places, distances, period) in runs.items():
        above.plot(places[:, 0], places[:, 1], label=f"hand, {name} filter")
        over_time.plot(np.arange(len(distances)) * period, distances, label=f"{name} filter")
    above.plot(*np.transpose([PARTNER_FROM, PARTNER_TO])[:2], "k--", label="partner, to and fro")
    above.plot(*GOAL[:2], "o", color="0.7", label=f"goal until {SWITCH_S} s")
    above.plot(*LATER_GOAL[:2], "go", label="goal after")
    over_time.axhline(separation, color="r", lw=0.8, label="kept by the filter")
    above.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    over_time.set(xlabel="time [s]", ylabel="distance from the partner's hand [m]", ylim=(0, None))
    for axes in (above, over_time):
        axes.legend(fontsize="small")
    figure.savefig(path, dpi=110, format="png")


if __name__ == "__main__":
    try:
        main()
    except (HriError, OSError) as error:
        sys.exit(f"steer_policy.py: {error}")
