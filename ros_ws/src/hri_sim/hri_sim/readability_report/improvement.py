"""Who improved: policies judged before and after by trials of their own, in which nothing is learnt."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hri_planner.pibb.costs import WEIGHTS
from hri_sim.benchmark.report import markdown_table
from hri_sim.readability.learning import Learnt
from hri_sim.readability_report.cases import CASES, TEACHER, A, Case, case_of
from hri_sim.readability_report.intervals import estimate, share, text
from hri_sim.readability_report.laboratory import Laboratory, Person
from hri_sim.readability_report.trials import COST

LESS_TIME = 0.10
"""J_pred must be lower by this share; as in :attr:`Learnt.improved`."""


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """By experiment, of all seeds."""
    found = {}
    for case in (*CASES, TEACHER):
        people = list(laboratory.of(case).values())
        if people:
            found[case.name] = _of(case, people, laboratory.smoke)
    return found


def _of(case: Case, people: Sequence[Person], smoke: bool) -> dict[str, Any]:
    learnt = [person.learnt for person in people]
    experiment = case.experiment(smoke)
    plan = experiment.improvement
    costs = [person.trials.by_update(person.trials.columns[COST]) for person in people]
    return {
        "seeds": len(people),
        "goals": len(people[0].trials.goals),
        "updates": plan.updates,
        "rollouts": plan.rollouts,
        "trials": people[0].trials.count,
        "weights": next(
            (name for name, own in WEIGHTS.items() if own == experiment.weights), "its own"
        ),
        "readings": learnt[0].before.trials,
        "improved": share([one.improved for one in learnt]),
        "sooner": share([person.change <= -LESS_TIME for person in people]),
        "no_more_errors": share([one.after.error <= one.before.error for one in learnt]),
        "pred_time_change": estimate([person.change for person in people]),
        "error_before": estimate([one.before.error for one in learnt]),
        "error_after": estimate([one.after.error for one in learnt]),
        "error_change": estimate([one.after.error - one.before.error for one in learnt]),
        "contacts": sum(map(_contacts, learnt)),
        "broken_off": sum(map(_broken_off, learnt)),
        "all_trials": sum(person.trials.count + _read(person.learnt) for person in people),
        "nearest_m": min(_nearest(person) for person in people),
        "from_person_m": min(one.from_person for one in learnt),
        "from_obstacles_m": min(one.from_obstacles for one in learnt),
        "cost_first": estimate([cost[0] for cost in costs]),
        "cost_last": estimate([cost[-1] for cost in costs]),
        "people": [_one(person) for person in people],
    }


def _one(person: Person) -> dict[str, Any]:
    """Of one person: by what the judgement is made."""
    learnt = person.learnt
    return {
        "seed": learnt.seed,
        "improved": learnt.improved,
        "pred_time_before_s": learnt.before.prediction_time,
        "pred_time_after_s": learnt.after.prediction_time,
        "errors_before": round(learnt.before.error * learnt.before.trials),
        "errors_after": round(learnt.after.error * learnt.after.trials),
        "contacts": _contacts(learnt),
        "nearest_m": _nearest(person),
    }


def _readings(learnt: Learnt) -> list[Any]:
    return [learnt.before, learnt.after, learnt.others_before, learnt.others_after]


def _contacts(learnt: Learnt) -> int:
    """In all trials, also those in which policies are judged."""
    return learnt.contacts + sum(one.contacts for one in _readings(learnt))


def _broken_off(learnt: Learnt) -> int:
    return learnt.broken_off + sum(one.broken_off for one in _readings(learnt))


def _read(learnt: Learnt) -> int:
    return sum(one.trials for one in _readings(learnt))


def _nearest(person: Person) -> float:
    return min(person.trials.nearest, *(one.clearance for one in _readings(person.learnt)))


def summary(found: Mapping[str, Any]) -> dict[str, Any]:
    """The figures of each experiment that others read in ``dmp.json``; changes are means over people."""
    return {
        name: {
            "seeds": one["seeds"],
            "improved_share": one["improved"]["share"],
            "pred_time_change": one["pred_time_change"]["mean"],
            "error_change": one["error_change"]["mean"],
            "contacts": one["contacts"],
            "cost_first": one["cost_first"]["mean"],
            "cost_last": one["cost_last"]["mean"],
        }
        for name, one in found.items()
        if name != TEACHER.name
    }


def lines(found: Mapping[str, Any]) -> list[str]:
    """What was done, and who improved."""
    first = next(iter(found.values()))
    done = [
        [
            f"`{name}`", case_of(name).text, str(one["seeds"]),
            f"{one['goals']} × {one['updates']} × {one['rollouts']}", str(one["trials"]),
            one["weights"].replace("_", " "),
        ]
        for name, one in found.items()
    ]  # fmt: skip
    rows = [
        [
            f"`{name}`",
            text(one["improved"], 0, scale=100.0),
            text(one["sooner"], 0, scale=100.0),
            text(one["no_more_errors"], 0, scale=100.0),
            text(one["pred_time_change"], 1, scale=100.0, sign=True),
            f"{100.0 * one['pred_time_change']['median']:+.1f}",
            f"{100.0 * one['error_before']['mean']:.1f}",
            f"{100.0 * one['error_after']['mean']:.1f}",
            text(one["error_change"], 1, scale=100.0, sign=True),
            f"{one['contacts']} of {one['all_trials']:,}",
            str(one["broken_off"]),
            f"{100.0 * one['nearest_m']:.1f}",
            f"{100.0 * one['from_person_m']:.1f}",
            f"{100.0 * one['from_obstacles_m']:.1f}",
        ]
        for name, one in found.items()
    ]
    least = f"{100.0 * LESS_TIME:.0f} %"
    return [
        "Each seed is one person, with traits and moods of its own, who takes part once. Weights of the "
        "costs: balanced, or those of the thesis' table 7.2 for end-effector or joint control.\n",
        markdown_table(
            [
                "experiment", "what it is", "people", "goals × updates × roll-outs", "trials each",
                "weights",
            ],
            done,
        ),
        f"Judged by trials without exploration, {first['readings'] // first['goals']} of each goal with "
        "the first policy and as many with the last, the mean of those after the last updates where the "
        "experiment says so: the same person in the same moods. *Improved*: J_pred "
        f"at least {least} lower, and errors not higher. In brackets: 95 % intervals over people, shares "
        "by Wilson, means by a bootstrap. Broken off: the robot did not arrive, or nobody answered; such a "
        "trial is made again, or left out where policies are judged. Contacts and nearest: in all "
        "trials, of learning and of judging, "
        "of any link of the robot with a person, an obstacle or the table. Where a key is pressed the "
        "person's arm rests; in the transfer experiments it reaches past the robot.\n",
        markdown_table(
            [
                "experiment", "improved [%]", f"J_pred {least} lower [%]", "errors not higher [%]",
                "J_pred, change [%]", "median", "errors before [%]", "after [%]", "change [points]",
                "contacts", "broken off", "nearest [cm]", "to a person, learning [cm]",
                "to obstacles, learning [cm]",
            ],
            rows,
        ),
        *([_who_did_not(found[A.name])] if A.name in found else []),
    ]  # fmt: skip


def _who_did_not(one: Mapping[str, Any]) -> str:
    """Those of experiment A who do not count as improved, and by what."""
    left = [person for person in one["people"] if not person["improved"]]
    if not left:
        return f"In `{A.name}` everybody improved.\n"
    texts = [
        f"seed {who['seed']} (J_pred {who['pred_time_before_s']:.2f} → {who['pred_time_after_s']:.2f} s, "
        f"errors {who['errors_before']} → {who['errors_after']})"
        for who in left
    ]
    return (
        f"In `{A.name}` who did not improve, with errors in {one['readings']} trials before and as many "
        f"after: {', '.join(texts)}.\n"
    )
