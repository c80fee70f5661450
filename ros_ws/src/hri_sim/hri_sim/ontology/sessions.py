"""Simulated dyads in each case: who sits where, what differs from time to time, and a recording of it.

As in the thesis' two experiments (4.6): ten people in cases 1 to 3 in three positions, eight in cases 4 to
20 in two of them, six of these in both; the other one is always the same experimenter. What a recording's
places and people differ by, from how the case is meant to be, is what makes cases hard to tell apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError
from hri_prediction.ontology.cases import REDUCED, cases, find_case
from hri_prediction.ontology.cutting import segments_of
from hri_prediction.ontology.table import SegmentTable, table_of
from hri_prediction.tracks.track import ArmTrack
from hri_sim.dyads.arms import SeatedArm
from hri_sim.dyads.drawing import PersonFactors, draw_person
from hri_sim.dyads.hands import STEP_S
from hri_sim.dyads.motion import DyadMotion
from hri_sim.dyads.setups import DyadSetup
from hri_sim.ontology.layout_file import load_layouts
from hri_sim.ontology.layouts import POSITIONS, Layout

FloatArray = NDArray[np.float64]

EXPERIMENTER = "experimenter"
SHOWN_SEED = 2
"""Of people and places that are shown to users: neither those that the shipped classifier has learnt (0)
nor those that reports are of (1)."""
FIRST_CASES = (1, 2, 3)
"""Of the first experiment, in all positions."""
SECOND_POSITIONS = ("frontal", "orthogonal")
"""Of the second experiment."""
POSITION_OF = {"opposite": "frontal", "corner": "orthogonal", "beside": "same side"}
"""Positions of the ontology by the arrangements of dyads."""
_SAME_M = 1e-6


@dataclass(frozen=True)
class DyadStudy:
    """What sessions have in common."""

    layout_jitter: float = parameter(
        0.04,
        "Standard deviation of an action space's place from session to session, along x and y",
        unit="m",
        low=0.0,
        high=0.2,
    )
    person_jitter: float = parameter(
        0.04,
        "Standard deviation of how somebody sits, and of how far round obstacles they reach, the same in "
        "all of their sessions",
        unit="m",
        low=0.0,
        high=0.2,
    )
    noise: float = parameter(
        0.0005, "Of motion capture, each coordinate", unit="m", low=0.0, high=0.02
    )
    pause: float = parameter(0.4, "Rest between encounters", unit="s", low=0.2, high=10.0)
    encounters: int = parameter(16, "How often both reach in a session", low=1, high=1000)
    people: int = parameter(
        12,
        "People besides the experimenter: the last sixth is in the second experiment alone, those between "
        "the first half and these in the first one alone",
        low=2,
        high=60,
    )

    def __post_init__(self) -> None:
        """Check the ranges."""
        validate(self)


@dataclass(frozen=True)
class Session:
    """A recording of a dyad.

    Attributes:
        number: In the study.
        case: Number of the case.
        position: How they sit.
        subject: Who the first of the two is; the other is the experimenter.
        seed: Of the study.
    """

    number: int
    case: int
    position: str
    subject: str
    seed: int


def sessions_of(study: DyadStudy, seed: int) -> list[Session]:
    """All sessions of both experiments."""
    names = [f"s{number + 1}" for number in range(study.people)]
    apart = study.people // 6
    first, second = names[: len(names) - apart], names[: len(names) // 2]
    second += names[len(names) - apart :]
    place = _turns()
    wanted = [
        (case, position, name) for name in first for position in POSITIONS for case in FIRST_CASES
    ]
    wanted += [
        (case.number, SECOND_POSITIONS[(place[case.number] + index) % 2], name)
        for index, name in enumerate(second)
        for case in cases()
        if case.number not in FIRST_CASES
    ]
    return [Session(number, *one, seed) for number, one in enumerate(wanted)]


def _turns() -> dict[int, int]:
    """Where each case of the second experiment comes in its class of the reduced ontology.

    Within each class a person sits in both positions in turn: where people sit must not tell the class.
    """
    return {
        number: turn
        for group in REDUCED
        for turn, number in enumerate(n for n in group if n not in FIRST_CASES)
    }


def layout_of(case: int, position: str) -> Layout:
    """How a case is meant to be, the same in every study.

    Raises:
        ConfigError: when there is no such case or position.
    """
    layouts = load_layouts()
    number = find_case(case).number
    if (number, position) not in layouts:
        raise ConfigError(f"position {position!r}", expected="one of " + ", ".join(POSITIONS))
    return layouts[number, position]


@dataclass(frozen=True, eq=False)
class _Person:
    """Somebody: how they move, sit and reach round obstacles."""

    factors: PersonFactors
    seat: FloatArray
    bow: float


def _person(name: str, study: DyadStudy, seed: int) -> _Person:
    rng = np.random.default_rng([seed, *name.encode()])
    factors = draw_person(rng)
    seat = study.person_jitter * np.array((*rng.standard_normal(2), 0.5 * rng.standard_normal()))
    return _Person(factors, seat, study.person_jitter * float(rng.standard_normal()))


def places_of(
    session: Session, study: DyadStudy
) -> tuple[Layout, tuple[PersonFactors, PersonFactors]]:
    """Where everything is in a session, which is not quite where it is meant to be, and who the two are."""
    layout = layout_of(session.case, session.position)
    people = [_person(name, study, session.seed) for name in (session.subject, EXPERIMENTER)]
    rng = np.random.default_rng([session.seed, session.number, 1])
    spaces = layout.spaces.copy()
    for agent, space in np.ndindex(2, 2):
        off = study.layout_jitter * np.array((*rng.standard_normal(2), 0.0))
        place = layout.spaces[agent, space]
        # A space that both have is moved once, for both.
        twins = np.linalg.norm(layout.spaces - place, axis=-1) < _SAME_M
        if agent == 0 or twins.sum() == 1:
            spaces[twins] = place + off
    bow = layout.bow.copy()
    for agent, person in enumerate(people):
        length = float(np.linalg.norm(bow[agent]))
        if length > 0.0:
            bow[agent] *= max(length + person.bow, 0.0) / length
    shoulders = layout.shoulders + np.array([person.seat for person in people])
    moved = replace(layout, shoulders=shoulders, spaces=spaces, bow=bow)
    return moved, (people[0].factors, people[1].factors)


def setup_of(
    session: Session, study: DyadStudy
) -> tuple[DyadSetup, tuple[PersonFactors, PersonFactors]]:
    """The same for those who move hands."""
    layout, people = places_of(session, study)
    return layout.setup(find_case(session.case).name), people


def dyad_in_case(
    case: int, position: str, seed: int
) -> tuple[DyadSetup, tuple[PersonFactors, PersonFactors]]:
    """Two people in a case: places and people, as in a session of some study."""
    return setup_of(Session(seed, case, position, f"s{seed}", seed), DyadStudy())


def record_session(session: Session, study: DyadStudy) -> tuple[ArmTrack, ArmTrack]:
    """What motion capture sees of a session: right arms of subject and experimenter."""
    setup, people = setup_of(session, study)
    rng = np.random.default_rng([session.seed, session.number, 2])
    motion = DyadMotion(setup, rng, pause=study.pause, encounters=study.encounters, people=people)
    hands = [motion.at(0)]
    rest = round(2.0 * study.pause / STEP_S)
    while rest:
        hands.append(motion.at(len(hands)))
        rest -= motion.over
    time_s: FloatArray = STEP_S * np.arange(len(hands), dtype=float)
    names = (session.subject, EXPERIMENTER)
    tracks = []
    for agent, name in enumerate(names):
        arm = SeatedArm(setup.shoulders[agent], np.full(len(hands), setup.yaw[agent]))
        points = arm.keypoints(np.array(hands)[:, agent])
        points = points + study.noise * rng.standard_normal(points.shape)
        tracks.append(
            ArmTrack(
                time_s,
                points,
                subject=name,
                task=find_case(session.case).name,
                trial=session.number,
                source=f"simulated dyad, {session.position}, seed {session.seed}",
            )
        )
    return tracks[0], tracks[1]


def table_of_session(session: Session, study: DyadStudy) -> SegmentTable:
    """The segments of a session."""
    rows = [
        s.features for s in segments_of(record_session(session, study)) if s.features is not None
    ]
    count = len(rows)
    return table_of(
        rows,
        [session.case] * count,
        [session.subject] * count,
        [session.position] * count,
        [session.number] * count,
    )
