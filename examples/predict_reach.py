"""Predict a reach while it happens, from a track, without ROS.

Trains a small task library, then feeds one reach that it has not seen, sample by sample, as motion
capture would deliver it. Prints how far the predicted end of the wrist is from the true one.

    scripts/_run_in_env python examples/predict_reach.py
    scripts/_run_in_env python examples/predict_reach.py --file reaches.npz --trial 3 --plot out.png
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from hri_prediction.errors import DataError, HriError
from hri_prediction.prediction import ReachPredictor, ReachState, train_library
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.segmentation import find_reaches
from hri_prediction.tracks.track import ArmTrack
from hri_sim.people.training import training_reaches
from hri_sim.scenario.schema import PersonSpec

WRIST = 2
TARGETS = {"left": (0.45, -0.25, 0.15), "middle": (0.35, 0.05, 0.15), "right": (0.45, 0.30, 0.15)}


def simulated_tracks() -> list[ArmTrack]:
    """Eight reaches of one simulated person to each of three targets, 250 Hz with 2 mm of noise."""
    rng = np.random.default_rng(1)
    person = PersonSpec()
    return [
        track
        for name, target in TARGETS.items()
        for track in training_reaches(person, person.home, target, 8, rng, task=name)
    ]


def main() -> None:
    """Train on all tracks but one, then predict that one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--file", help="track file instead of simulated reaches")
    parser.add_argument("--trial", type=int, default=0, help="the track that is predicted, from 0")
    parser.add_argument("--plot", metavar="PNG", help="draw prediction and truth into a file")
    options = parser.parse_args()

    tracks = load_tracks(options.file) if options.file else simulated_tracks()
    if not 0 <= options.trial < len(tracks) or len(tracks) < 2:
        raise DataError(
            f"trial {options.trial} of {len(tracks)} tracks",
            expected=f"0 to {len(tracks) - 1}, and a second track to learn from",
        )
    track = tracks.pop(options.trial)
    library = train_library(tracks)
    print(f"library: {', '.join(task.name for task in library.tasks)} ({len(tracks)} tracks)")

    # The truth to compare with: where the reach ends.
    reaches = find_reaches(track.time_s, track.keypoints[:, WRIST])
    if not reaches:
        raise DataError(f"trial {options.trial} holds no reach")
    reach = reaches[0]
    end = track.keypoints[np.searchsorted(track.time_s, reach.end_s) - 1, WRIST]
    print(f"true reach: {reach.duration_s:.2f} s, task {track.task!r}")

    predictor = ReachPredictor(library)
    curves = []
    next_s = reach.onset_s
    print("share  predicted task     probability  wrist end error  standard deviation")
    for sample in track.samples():
        predictor.observe(sample)
        time_s = track.time_s[0] + sample.stamp_ns * 1e-9
        if time_s < next_s or time_s > reach.end_s:
            continue
        prediction = predictor.predict()
        if prediction is None or prediction.state is not ReachState.REACHING:
            continue
        next_s = time_s + 0.1 * reach.duration_s
        # Where the wrist is expected when the reach is expected to end.
        left_s = reach.end_s - time_s
        index = min(np.searchsorted(prediction.times_s, left_s), len(prediction.times_s) - 1)
        error = np.linalg.norm(prediction.mean[index, WRIST] - end)
        spread = np.sqrt(np.linalg.eigvalsh(prediction.covariance[index, WRIST])[-1])
        best = int(np.argmax(prediction.task_probabilities))
        print(
            f"{(time_s - reach.onset_s) / reach.duration_s:4.0%}   "
            f"{prediction.task_names[best]:<17} {prediction.task_probabilities[best]:11.2f}  "
            f"{error * 1e3:12.0f} mm  {spread * 1e3:15.0f} mm"
        )
        curves.append((time_s, prediction))

    if options.plot:
        plot(track, curves, options.plot)
        print(f"drawn: {options.plot}")


def plot(track: ArmTrack, curves: list, path: str) -> None:
    """The wrist's coordinates over time: truth, and the predictions made on the way."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    for axis, name in enumerate("xyz"):
        axes[axis].plot(track.time_s, track.keypoints[:, WRIST, axis], "k", lw=2, label="tracked")
        for time_s, prediction in curves:
            axes[axis].plot(
                time_s + prediction.times_s, prediction.mean[:, WRIST, axis], lw=0.8, alpha=0.7
            )
        axes[axis].set_ylabel(f"wrist {name} [m]")
        axes[axis].set_xlim(track.time_s[0], track.time_s[-1])
    axes[2].set_xlabel("time [s]")
    figure.savefig(path, dpi=110, format="png")


if __name__ == "__main__":
    try:
        main()
    except (HriError, OSError) as error:
        sys.exit(f"predict_reach.py: {error}")
