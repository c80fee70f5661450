"""Learn a probabilistic movement primitive and condition it on what has been seen so far.

A ProMP is a Gaussian over trajectories. Conditioning on the first part of a movement narrows the
rest of it; the result is a new object, the original stays as it was.

    scripts/_run_in_env python examples/condition_promp.py --plot promp.png
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from hri_prediction.errors import HriError
from hri_prediction.promp import Demonstration, LearningConfig, ProMP, learn

PHASES = np.linspace(0.0, 1.0, 41)


def demonstrations(rng: np.random.Generator, count: int = 30) -> list[Demonstration]:
    """Planar minimum-jerk reaches of 0.4 m whose direction, and so whose end, varies."""
    shape = PHASES**3 * (10.0 - 15.0 * PHASES + 6.0 * PHASES**2)
    found = []
    for _ in range(count):
        angle = rng.normal(0.0, 0.5)
        end = 0.4 * np.array([np.cos(angle), np.sin(angle)])
        path = shape[:, None] * end + 0.002 * rng.standard_normal((len(PHASES), 2))
        found.append(Demonstration(PHASES, path))
    return found


def describe(label: str, model: ProMP) -> None:
    """Print where a model expects the movement to end."""
    mean = model.trajectory_mean([1.0])[0]
    spread = np.sqrt(np.diagonal(model.trajectory_covariance([1.0])[0]))
    print(
        f"{label:<22} end at x {mean[0] * 1e3:4.0f} ± {spread[0] * 1e3:3.0f} mm, "
        f"y {mean[1] * 1e3:4.0f} ± {spread[1] * 1e3:3.0f} mm"
    )


def main() -> None:
    """Learn, condition on growing parts of one new reach, compare with its true end."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plot", metavar="PNG", help="draw the distributions into a file")
    options = parser.parse_args()

    rng = np.random.default_rng(7)
    prior = learn(demonstrations(rng), LearningConfig(weights_per_dim=8))
    new = demonstrations(rng, 1)[0]

    describe("before the reach", prior)
    stages = {"prior": prior}
    for share in (0.2, 0.35, 0.5):
        seen = new.phases <= share
        posterior = prior.condition(new.phases[seen], new.values[seen])
        describe(f"after {share:.0%} of the reach", posterior)
        stages[f"{share:.0%} seen"] = posterior
    print(f"{'truth':<22} end at x {new.values[-1, 0] * 1e3:4.0f}       mm, "
          f"y {new.values[-1, 1] * 1e3:4.0f}       mm")  # fmt: skip

    # Likelihoods tell which model a movement belongs to: here, forward against mirrored reaches.
    mirrored = learn([Demonstration(d.phases, -d.values) for d in demonstrations(rng)])
    seen = new.phases <= 0.35
    scores = [m.log_likelihood(new.phases[seen], new.values[seen]) for m in (prior, mirrored)]
    print(f"log likelihood of its first 35 %: forward {scores[0]:.0f}, mirrored {scores[1]:.0f}")

    if options.plot:
        plot(stages, new, options.plot)
        print(f"drawn: {options.plot}")


def plot(stages: dict[str, ProMP], new: Demonstration, path: str) -> None:
    """Lateral coordinate over the phase, mean ± 2 standard deviations of each stage."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.5), layout="constrained")
    axis = figure.subplots()
    for label, model in stages.items():
        mean = model.trajectory_mean(PHASES)[:, 1]
        band = 2.0 * np.sqrt(model.trajectory_covariance(PHASES)[:, 1, 1])
        (line,) = axis.plot(PHASES, mean, label=label)
        axis.fill_between(PHASES, mean - band, mean + band, color=line.get_color(), alpha=0.15)
    axis.plot(new.phases, new.values[:, 1], "k.", ms=3, label="the new reach")
    axis.set_xlabel("phase")
    axis.set_ylabel("lateral position [m]")
    axis.legend()
    figure.savefig(path, dpi=110, format="png")


if __name__ == "__main__":
    try:
        main()
    except (HriError, OSError) as error:
        sys.exit(f"condition_promp.py: {error}")
