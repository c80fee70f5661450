"""Two simulated people, recorded."""

from dataclasses import dataclass

import numpy as np

from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.track import ArmSample, ArmTrack
from hri_sim.dyads.bodies import dyad_bodies
from hri_sim.dyads.motion import DyadMotion
from hri_sim.dyads.setups import draw_setup
from hri_sim.people.capture import Capture
from hri_sim.people.seeding import dyad_generator
from hri_sim.people.tracking import SAMPLE_PERIOD_NS


@dataclass(frozen=True)
class RecordedDyad:
    """What was recorded, and what truly happened.

    Attributes:
        samples: By person, as motion capture delivered them.
        goals: Where both meant to go, encounter by encounter (n, 2, 3) [m].
        rests: Where both truly were before each encounter, and after the last (n + 1, 2, 3) [m].
    """

    samples: dict[str, list[ArmSample]]
    goals: np.ndarray
    rests: np.ndarray

    def tracks(self, trial: int = 0) -> list[ArmTrack]:
        """The same as tracks of one trial."""
        return [
            ArmTrack(
                [sample.stamp_ns * 1e-9 for sample in samples],
                [sample.keypoints for sample in samples],
                subject=person,
                task="table",
                trial=trial,
            )
            for person, samples in self.samples.items()
        ]


def record_dyad(
    seed: int, encounters: int, people: tuple[str, str] = ("ann", "bob")
) -> RecordedDyad:
    """Some encounters, as the node ``dyad`` publishes them, until half a second after the last."""
    rng = dyad_generator(seed)
    setup = draw_setup("dyad", "opposite", rng)
    motion = DyadMotion(setup, rng, pause=0.5, encounters=encounters)
    capture = Capture(dyad_bodies(motion, people, seed, Placement(0.85)), 0)
    samples: dict[str, list[ArmSample]] = {person: [] for person in people}
    goals: list[np.ndarray] = []
    rests: list[np.ndarray] = []
    step = ended = 0
    while not ended or step < ended + 125:
        step += 1
        list(capture.truth(step * SAMPLE_PERIOD_NS))
        if motion.begun > len(goals):
            goals.append(motion.reaches.goal[0] + (0.85, 0.0, 0.0))
            rests.append(motion.reaches.start[0] + (0.85, 0.0, 0.0))
        for person, sample in capture.tracked(step * SAMPLE_PERIOD_NS):
            samples[person].append(sample)
        if not ended and motion.begun == encounters and motion.resting:
            ended = step
    rests.append(motion.at(step) + np.array((0.85, 0.0, 0.0)))
    return RecordedDyad(samples, np.array(goals), np.array(rests))
