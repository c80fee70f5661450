"""Which pictures the report has, and what is said below them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hri_sim.readability_report.cases import (
    A_3,
    END_EFFECTOR,
    PAIRS,
    TEACHER,
    TEACHER_SEED,
    A,
    B,
)
from hri_sim.readability_report.course_pictures import (
    draw_course,
    draw_jerk,
    draw_transfer_cost,
    draw_transfer_time,
)
from hri_sim.readability_report.drawing import BELL_TRIALS
from hri_sim.readability_report.goal_pictures import draw_finals, draw_goal
from hri_sim.readability_report.laboratory import Laboratory, Person

FOLDER = "dmp"
_FIRST_FIGURE = 5
"""That of the first goal is 7.5."""


class _Album:
    """Pictures that are drawn so far."""

    def __init__(self, laboratory: Laboratory) -> None:
        self.laboratory = laboratory
        self.found: dict[str, Any] = {}
        (laboratory.out / FOLDER).mkdir(parents=True, exist_ok=True)

    def add(self, name: str, caption: str) -> Path:
        """The file of a picture that is about to be drawn."""
        self.found[name] = {"file": f"{FOLDER}/{name}.png", "caption": caption}
        return self.laboratory.out / FOLDER / f"{name}.png"


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Draw them, of the experiments that are there; file and caption of each, by name."""
    laboratory.progress.say("pictures")
    album = _Album(laboratory)
    if laboratory.of(END_EFFECTOR):
        _preliminary(album)
    if laboratory.of(A):
        _alone(album)
    both = [(a, b) for a, b in PAIRS if laboratory.both(a, b)]
    if (A, B) in both:
        _costs(album)
    if both:
        titles = {A: "A and B, mean and five samples", A_3: "A and B, mean and two samples"}
        path = album.add(
            "transfer_time",
            "Response time of A, which begins with straight ways, and of B, which begins with what another "
            "person taught elsewhere; mean and standard deviation over people (figure 7.13).",
        )
        draw_transfer_time([(titles[a], laboratory.both(a, b)) for a, b in both], path)
    return album.found


def _one(person: Person) -> str:
    """Who is shown."""
    return (
        f"the person of seed {person.learnt.seed}, whose J_pred changed as much as the median one's"
    )


def _preliminary(album: _Album) -> None:
    """Figures 7.5 to 7.9."""
    laboratory = album.laboratory
    experiment = END_EFFECTOR.experiment(laboratory.smoke)
    people = list(laboratory.of(END_EFFECTOR).values())
    shown = laboratory.representative(END_EFFECTOR)
    for number, goal in enumerate(experiment.goals):
        path = album.add(
            f"goal_{goal}",
            f"`{END_EFFECTOR.name}`, {goal} (figure 7.{_FIRST_FIGURE + number}). Above: the ways of "
            f"{_one(shown)}, when nothing interferes. Below: total cost and J_pred of all trials of "
            "learning, of all people; lines: mean and standard deviation of the trials around, weighted by "
            f"a bell of {BELL_TRIALS:g} trials.",
        )
        draw_goal(experiment, goal, people, shown, path)
    first = next(iter(experiment.goals))
    path = album.add(
        "finals",
        f"Left: the last ways to {first} of all people. Middle and right: those of {_one(shown)}, to all "
        "goals; dotted: the initial ones (figure 7.9).",
    )
    draw_finals(experiment, people, shown, path)


def _alone(album: _Album) -> None:
    """Figures 7.10 and 7.11."""
    people, shown = list(album.laboratory.of(A).values()), album.laboratory.representative(A)
    path = album.add(
        "course",
        f"`{A.name}`: total cost, J_pred and share of right guesses in each update (figure 7.10). One "
        f"person: {_one(shown)}.",
    )
    draw_course(people, shown, path)
    path = album.add(
        "jerk",
        f"`{A.name}`: jerk of joints and tool over the trials (figure 7.11); points: {_one(shown)}. The "
        "further out, the more the robot had to give way, or was made to explore.",
    )
    draw_jerk(people, shown, path)


def _costs(album: _Album) -> None:
    """Figure 7.12."""
    laboratory = album.laboratory
    shown = laboratory.representative(B)
    teacher = laboratory.of(TEACHER).get(shown.learnt.seed + TEACHER_SEED)
    if teacher is None:
        return
    path = album.add(
        "transfer_cost",
        f"Left: costs of the person of seed {teacher.learnt.seed}, who taught in `{TEACHER.name}` what "
        f"seed {shown.learnt.seed} of `{B.name}` began with. Others: total costs of `{A.name}` and "
        f"`{B.name}` by goal, both in the units of A (figure 7.12).",
    )
    draw_transfer_cost(teacher, laboratory.both(A, B), (A, B), laboratory.smoke, path)


def lines(found: Mapping[str, Any]) -> list[str]:
    """Pictures with captions."""
    return [f"![{name}]({one['file']})\n\n{one['caption']}\n" for name, one in found.items()]
