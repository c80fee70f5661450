"""Command line of ``scripts/learn_costs.py``: by which costs people move beside each other, by case."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import matplotlib.pyplot as plt
import numpy as np
import typer
from rich.console import Console

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.ontology.cases import find_case
from hri_prediction.ontology.cost_file import CaseCosts, LearntCosts
from hri_prediction.ontology.costs import COSTS, LENGTH_M
from hri_prediction.ontology.features import COUNT
from hri_prediction.ontology.movements import PENALTY, SAMPLES, Movement
from hri_prediction.ontology.piirl import cosine
from hri_prediction.ontology.recordings import RecordedSession, read_sessions
from hri_prediction.results.options import Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.ontology.case_costs import (
    CaseJob,
    do_cases,
    recorded_movements,
    simulated_sessions,
)
from hri_sim.ontology.cosine import ARM, SPREADS
from hri_sim.ontology.data import SIMULATED
from hri_sim.ontology.sessions import DyadStudy, Session
from hri_sim.ontology.training_command import RUNS
from hri_sim.readability_report.run_folder import write_json

FILE, TEXT, PICTURE, FIGURES = "costs.json", "costs.md", "costs.png", "results.json"
PEOPLE, SMOKE_PEOPLE = 6, 1
SMOKE = DyadStudy(encounters=3)
DEFAULT_CASES = ("case_1", "case_2", "case_3")
"""Those of the thesis' figure 4.5."""
BENT = "movements of simulated dyads, bent to be optimal for costs set by hand"
KNOWN = (
    "Movements were bent to be optimal for costs that are set by hand, of their case's edges; cosine: "
    "between these and what was learnt, of nearness alone, both scaled."
)

REDRAWN = 4
"""So often what might have been done besides what was recorded is drawn anew."""
ALIKE = 0.9
"""Weights of which those of another draw are less like than this (cosine) hang on what was drawn."""
RECORDED = (
    "Nobody knows the costs of people who were recorded. Of simulated people, seen as motion capture sees "
    "them, costs of nearness are found little better than equal weights would have them, and which parts "
    "they are of is not: take these as a cost as a whole, not as a list of what people look at. Alike: the "
    f"least cosine to weights of nearness of {REDRAWN} further draws of what might have been done, scaled."
)

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def draw_costs(path: Path, costs: LearntCosts) -> None:
    """Bars of how much each cost counts, case by case, like figure 4.5 of the thesis."""
    figure, rows = plt.subplots(
        len(costs.cases), 1, figsize=(9.0, 1.9 * len(costs.cases) + 1.2), squeeze=False, sharex=True,
        layout="constrained",
    )  # fmt: skip
    for axes, (name, one) in zip(rows[:, 0], costs.cases.items(), strict=True):
        axes.bar(range(len(COSTS)), one.scaled, color="#2b6cb0")
        axes.set_ylabel(f"{name.replace('_', ' ')}\n({one.movements} movements)", fontsize=7)
        axes.tick_params(labelsize=7)
    names = [f"{number}: {name}" for number, name in enumerate(COSTS, start=1)]
    rows[-1, 0].set_xticks(range(len(COSTS)), names, rotation=90, size=6)
    figure.suptitle(
        "Weights of the costs, scaled by how much each differs among what might have been done",
        size=9,
    )
    figure.savefig(path, dpi=110)
    plt.close(figure)


def draw_all_costs(path: Path, costs: LearntCosts) -> None:
    """How much each cost counts in each case, as shares, in one picture."""
    shares = np.array([one.scaled / max(one.scaled.sum(), 1e-300) for one in costs.cases.values()])
    figure, axes = plt.subplots(figsize=(9.0, 0.26 * len(shares) + 2.2), layout="constrained")
    image = axes.imshow(100.0 * shares, cmap="Blues", aspect="auto")
    axes.set_yticks(range(len(shares)), [name.replace("_", " ") for name in costs.cases], size=7)
    names = [f"{number}: {name}" for number, name in enumerate(COSTS, start=1)]
    axes.set_xticks(range(len(COSTS)), names, rotation=90, size=6)
    figure.colorbar(image, ax=axes, label="share of the scaled weights [%]")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def report(
    costs: LearntCosts, origin: dict[str, Any], alike: Mapping[str, float], warned: Sequence[str]
) -> str:
    """The text of ``costs.md``.

    Args:
        costs: What was learnt.
        origin: Of it.
        alike: How like those of other draws they are, by case, of people who were recorded.
        warned: What their user should know first.
    """
    text = [
        "# By which costs people move beside each other\n",
        f"{origin_line(origin)} {costs.about}.\n",
        "Path-integral inverse reinforcement learning: what people did, beside what they might have done. "
        "The scale of weights means nothing. Each cost with its share of the scaled weights.\n",
        *cost_table(costs, alike),
        *(["", RECORDED] if alike else []),
        *(f"\n**Warning**: {one}." for one in warned),
    ]
    return "\n".join([*text, "", f"![Weights]({PICTURE})", ""])


def cost_table(costs: LearntCosts, alike: Mapping[str, float] | None = None) -> list[str]:
    """Which costs count in each case, by their shares of the scaled weights.

    Args:
        costs: What was learnt.
        alike: How like those of other draws they are, by case; of none: not told.
    """
    known = any(one.cosine is not None for one in costs.cases.values())
    more = (" cosine |" if known else "") + (" alike |" if alike else "")
    text = [
        "| case | movements | costs that count |" + more,
        "| --- | --- | --- |" + " --- |" * more.count("|"),
    ]
    for name, one in costs.cases.items():
        shares = one.scaled / max(float(one.scaled.sum()), 1e-300)
        order = [int(k) for k in np.argsort(-shares) if shares[k] >= 0.01]
        words = ", ".join(f"{k + 1} {COSTS[k]} {100 * shares[k]:.0f} %" for k in order)
        truth = "" if one.cosine is None else f" {one.cosine:.3f} |"
        again = f" {alike[name]:.2f} |" if alike else ""
        text.append(f"| {name} | {one.movements} | {words or 'none'} |{truth}{again}")
    if known:
        text += ["", KNOWN]
    return text


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def learn(
    out: Annotated[Path, typer.Option(help=f"Folder for {FILE}, {TEXT}, {PICTURE} and {FIGURES}.")],
    data: Annotated[
        str,
        typer.Option(
            help="simulated; or a list of recordings, sessions.yaml or the folder it is in."
        ),
    ] = SIMULATED,
    case: Annotated[
        list[str] | None,
        typer.Option(
            help="A case, 1 to 20; may be given several times. Default: 1, 2 and 3; of recordings: all "
            "that there are.",
            show_default=False,
        ),
    ] = None,
    people: Annotated[
        int | None,
        typer.Option(
            help=f"Simulated people of each case in a position. Default: {PEOPLE}; smoke: {SMOKE_PEOPLE}.",
            min=1,
            show_default=False,
        ),
    ] = None,
    samples: Annotated[int, typer.Option(help="Drawn around each movement.", min=1)] = SAMPLES,
    penalty: Annotated[
        float,
        typer.Option(help="Of the sum of the scaled weights: larger leaves fewer.", min=1e-6),
    ] = PENALTY,
    length: Annotated[
        float | None,
        typer.Option(
            help="Of recordings: distance over which nearness falls to 1/e, metres. Default: "
            f"{LENGTH_M:g}, by which simulated people move.",
            min=0.01,
            max=2.0,
            show_default=False,
        ),
    ] = None,
    joints: Annotated[
        str,
        typer.Option(
            help="What might have moved otherwise: the arm alone, or all fourteen joints, which do not "
            "follow from recorded keypoints of an arm.",
            metavar="|".join(SPREADS),
        ),
    ] = ARM,
    seed: Annotated[int, typer.Option(help="Of people, and of what is drawn.", min=0)] = 0,
    workers: Workers = None,
    runs: Annotated[
        Path,
        typer.Option(help="Folder of what is learnt of simulated people, not learnt again."),
    ] = RUNS,
    smoke: Annotated[bool, typer.Option("--smoke", help="One person, three encounters.")] = False,
) -> None:
    """Learn which nearness of which parts of two arms people avoid, and how much, from how they move.

    From recordings; or, to see what the method finds, from movements of simulated people that are bent to
    be optimal for costs set by hand, of the edges of their case, which are held against what is learnt.
    """
    console = Console()
    if joints not in SPREADS:
        raise ConfigError(f"--joints {joints}", expected="one of " + ", ".join(SPREADS))
    if data != SIMULATED:
        for option, given in (("--people", people is not None), ("--smoke", smoke)):
            if given:
                raise ConfigError(
                    f"{option} with --data {data}",
                    expected="one of them: recordings are of the people they are of",
                )
    elif length is not None:
        raise ConfigError(
            f"--length {length:g} with simulated people",
            expected="--length with --data: the costs that they are bent by have one of their own",
        )
    reach = LENGTH_M if length is None else length
    make_folders(out=out, runs=runs)
    origin, study = results_origin(), SMOKE if smoke else DyadStudy()
    names = [find_case(name).name for name in case or ()]
    number = people or (SMOKE_PEOPLE if smoke else PEOPLE)
    cores = workers or available_cores()
    listed = {} if data == SIMULATED else _recorded(names, read_sessions(data))
    unused: list[str] = []
    with resumable(console, runs if data == SIMULATED else None), ProgressLine(console) as progress:
        of_cases: dict[str, tuple[tuple[Session, ...], tuple[Movement, ...]]]
        if data == SIMULATED:
            of_cases = {
                name: (simulated_sessions(name, study, number, seed), ())
                for name in names or DEFAULT_CASES
            }
            there = {name: _most_people(sessions) for name, (sessions, _) in of_cases.items()}
            if people is not None and people > min(there.values()):
                name = min(there, key=lambda name: there[name])
                raise ConfigError(
                    f"--people {people}: {name} has {there[name]} in each position",
                    expected=f"{min(there.values())} at most, or other cases",
                )
            fewer = [f"{name}: {count}" for name, count in there.items() if count < number]
            among = f" ({', '.join(fewer)})" if fewer else ""
            about = f"{BENT}, seed {seed}, {number} people in each position{among}"
        else:
            progress.say("recordings")
            sessions = [one for own in listed.values() for one in own]
            parts = recorded_movements(sessions, cores, progress.count)
            unused = [
                f"{one.bag.name}: no movement of which all of both arms is seen"
                for one, part in zip(sessions, parts, strict=True)
                if not part
            ]
            left = iter(parts)
            of_cases = {
                name: ((), tuple(each for _ in own for each in next(left)))
                for name, own in listed.items()
            }
            about = f"recordings of {Path(data).name}, seed {seed}"
        jobs = [
            CaseJob(name, simulated, recorded, study, samples, penalty, seed, joints, reach)
            for name, (simulated, recorded) in of_cases.items()
        ]
        progress.say("cases")
        # Of recordings again, drawn anew: what comes of chance is not alike.
        redrawn = 0 if data == SIMULATED else REDRAWN
        draws = [[replace(job, seed=job.seed + k) for job in jobs] for k in range(1 + redrawn)]
        learnt = do_cases([job for draw in draws for job in draw], runs, cores, progress.count)
        told, *others = (
            dict(zip(of_cases, learnt[k * len(jobs) : (k + 1) * len(jobs)], strict=True))
            for k in range(1 + redrawn)
        )
    ordered = {name: one for name, one in told.items() if one is not None}
    missing = [f"{name}: nothing to learn from" for name in told.keys() - ordered.keys()]
    for line in (*unused, *sorted(missing)):
        console.print(line, highlight=False, soft_wrap=True)
    if not ordered:
        raise DataError(f"--data {data}: nothing to learn from")
    alike = {
        name: min(_alike(one, other[name]) for other in others)
        for name, one in ordered.items()
        if others
    }
    warned = list(_warnings(ordered, alike, joints, smoke=smoke))
    for text in warned:
        console.print(f"warning: {text}", highlight=False, soft_wrap=True)
    about += f"; {'arm alone' if joints == ARM else 'all joints'}, penalty {penalty:g}, {samples} samples"
    if smoke:
        about += "; a smoke run: of no use"
    costs = LearntCosts(ordered, reach, about, tuple(warned))
    costs.save(out / FILE, origin=origin)
    write_json(
        out / FIGURES,
        {
            "origin": origin,
            "smoke": smoke,
            "options": {
                "seed": seed,
                "people": number if data == SIMULATED else None,
                "samples": samples,
                "penalty": penalty,
                "length": reach,
                "joints": joints,
            },
            "cases": {name: one.scaled.tolist() for name, one in ordered.items()},
            "alike": alike,
            "warnings": warned,
        },
    )
    (out / TEXT).write_text(report(costs, origin, alike, warned))
    draw_costs(out / PICTURE, costs)
    console.print(f"{out / FILE}: {', '.join(ordered)}", highlight=False, soft_wrap=True)


def _alike(one: CaseCosts, other: CaseCosts | None) -> float:
    """Cosine of the weights of nearness, scaled; 0 where one of them has none."""
    if other is None:
        return 0.0
    first, second = one.scaled[:COUNT], other.scaled[:COUNT]
    return cosine(first, second) if first.any() and second.any() else 0.0


def _warnings(
    found: Mapping[str, CaseCosts], alike: Mapping[str, float], joints: str, *, smoke: bool
) -> Iterator[str]:
    """What whoever uses the costs should know first."""
    if smoke:
        yield f"a smoke run: {SMOKE.encounters} encounters of a session are too few to learn from"
    if alike and joints != ARM:
        yield (
            f"--joints {joints} of recordings: joints of the trunk do not follow from keypoints of an arm, "
            "and of simulated people what is found is worse than equal weights; use --joints arm"
        )
    for name, one in found.items():
        if not one.weights[:COUNT].any():
            yield (
                f"{name}: no nearness was found to be avoided, in {one.movements} movements; the planner "
                "refuses it"
            )
        elif name in alike and alike[name] < ALIKE:
            yield (
                f"{name}: the weights hang on what was drawn (cosine {alike[name]:.2f} between two draws); "
                "more recordings, or more --samples, may mend that"
            )


def _most_people(sessions: Sequence[Session]) -> int:
    """How many simulated people there are in a position."""
    return max(Counter(session.position for session in sessions).values())


def _recorded(
    names: list[str], sessions: list[RecordedSession]
) -> dict[str, tuple[RecordedSession, ...]]:
    """Recordings of each case: of these, or of all that there are."""
    there = sorted({session.case for session in sessions})
    missing = [name for name in names if find_case(name).number not in there]
    if missing:
        raise DataError(
            f"no recording is of {', '.join(missing)}",
            expected="one of " + ", ".join(find_case(number).name for number in there),
        )
    wanted = names or [find_case(number).name for number in there]
    return {name: tuple(s for s in sessions if find_case(s.case).name == name) for name in wanted}


def main() -> int:
    """Entry point."""
    app(prog_name="learn_costs.py")
    return 0
