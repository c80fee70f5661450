"""Command line of ``scripts/learn_costs.py``: by which costs people move beside each other, by case."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
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
from hri_prediction.ontology.movements import (
    ARM_SPREAD,
    SAMPLES,
    SPREAD,
    Movement,
    learn_costs,
    movements_of,
)
from hri_prediction.ontology.recordings import RecordedSession, read_sessions, tracks_of_bag
from hri_prediction.results.options import Workers, make_folders
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.benchmark.workers import do_all
from hri_sim.ontology.data import SIMULATED
from hri_sim.ontology.sessions import DyadStudy, Session, record_session, sessions_of
from hri_sim.readability_report.run_folder import write_json

FILE, TEXT, PICTURE, FIGURES = "costs.json", "costs.md", "costs.png", "results.json"
PEOPLE, SMOKE_PEOPLE = 6, 1
SMOKE = DyadStudy(encounters=3)
ALL_JOINTS, ARM = "all", "arm"
SPREADS = {ALL_JOINTS: SPREAD, ARM: ARM_SPREAD}
"""How far movements are drawn that might have been, by the joints that might have moved otherwise."""
DEFAULT_CASES = ("case_1", "case_2", "case_3")
"""Those of the thesis' figure 4.5."""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@dataclass(frozen=True)
class CaseJob:
    """A case to learn.

    Attributes:
        case: Its name.
        simulated: Sessions that are simulated.
        recorded: Sessions that were recorded.
        study: Of the simulated ones.
        samples: Drawn around each movement.
        penalty: λ of the weights.
        seed: Of what is drawn.
        joints: Which might have moved otherwise, of :data:`SPREADS`.
    """

    case: str
    simulated: tuple[Session, ...]
    recorded: tuple[RecordedSession, ...]
    study: DyadStudy
    samples: int
    penalty: float
    seed: int
    joints: str = ALL_JOINTS


def do_case(job: CaseJob) -> tuple[str, CaseCosts | str]:
    """Learn a case; a text says why it cannot be learnt."""
    movements: list[Movement] = []
    for session in job.simulated:
        movements += movements_of(record_session(session, job.study))
    for recorded in job.recorded:
        movements += movements_of(tracks_of_bag(recorded.bag, recorded.bodies, recorded.side))
    if not movements:
        return job.case, "no movement of which all of both arms is seen"
    rng = np.random.default_rng([job.seed, find_case(job.case).number])
    spread = SPREADS[job.joints]
    found = learn_costs(movements, rng, samples=job.samples, spread=spread, penalty=job.penalty)
    return job.case, CaseCosts(found.weights, found.scale, len(movements))


def do_cases(
    jobs: Sequence[CaseJob], workers: int, progress: Callable[[int, int], None]
) -> dict[str, CaseCosts | str]:
    """Learn several cases, in the order of the jobs; a text says why one cannot be learnt."""
    found: dict[str, CaseCosts | str] = {}
    with closing(do_all(do_case, jobs, workers=workers)) as results:
        for name, learnt in results:
            found[name] = learnt
            progress(len(found), len(jobs))
    return {job.case: found[job.case] for job in jobs}


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


def report(costs: LearntCosts, origin: dict[str, Any]) -> str:
    """The text of ``costs.md``."""
    text = [
        "# By which costs people move beside each other\n",
        f"{origin_line(origin)} {costs.about}.\n",
        "Path-integral inverse reinforcement learning: what people did, beside what they might have done. "
        "The scale of weights means nothing, their directions do. Each cost with its share of the scaled "
        "weights.\n",
        *cost_table(costs),
    ]
    return "\n".join([*text, "", f"![Weights]({PICTURE})", ""])


def cost_table(costs: LearntCosts) -> list[str]:
    """Which costs count in each case, by their shares of the scaled weights."""
    text = ["| case | movements | costs that count |", "| --- | --- | --- |"]
    for name, one in costs.cases.items():
        shares = one.scaled / max(float(one.scaled.sum()), 1e-300)
        order = [int(k) for k in np.argsort(-shares) if shares[k] >= 0.01]
        words = ", ".join(f"{k + 1} {COSTS[k]} {100 * shares[k]:.0f} %" for k in order)
        text.append(f"| {name} | {one.movements} | {words or 'none'} |")
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
        int, typer.Option(help="Simulated people of each case in a position.", min=1)
    ] = PEOPLE,
    samples: Annotated[int, typer.Option(help="Drawn around each movement.", min=1)] = SAMPLES,
    penalty: Annotated[
        float, typer.Option(help="Of the sum of the scaled weights: larger leaves fewer.", min=0.0)
    ] = 1.0,
    joints: Annotated[
        str,
        typer.Option(
            help="What might have moved otherwise: all fourteen joints, or those of the arm alone, for a "
            "robot that has no trunk (the costs that ship).",
            metavar="|".join(SPREADS),
        ),
    ] = ALL_JOINTS,
    seed: Annotated[int, typer.Option(help="Of people, and of what is drawn.", min=0)] = 0,
    workers: Workers = None,
    smoke: Annotated[bool, typer.Option("--smoke", help="One person, three encounters.")] = False,
) -> None:
    """Learn which nearness of which parts of two arms people avoid, and how much, from how they move."""
    console = Console()
    if joints not in SPREADS:
        raise ConfigError(f"--joints {joints}", expected="one of " + ", ".join(SPREADS))
    make_folders(out=out)
    origin, study = results_origin(), SMOKE if smoke else DyadStudy()
    names = [find_case(name).name for name in case or ()]
    if data == SIMULATED:
        chosen = simulated_cases(
            names or list(DEFAULT_CASES), study, SMOKE_PEOPLE if smoke else people, seed
        )
        about = f"simulated dyads, seed {seed}"
    else:
        chosen = _recorded(names, read_sessions(data))
        about = f"recordings of {Path(data).name}"
    jobs = [
        CaseJob(name, tuple(own), tuple(recorded), study, samples, penalty, seed, joints)
        for name, own, recorded in chosen
    ]
    with ProgressLine(console) as progress:
        progress.say("cases")
        told = do_cases(jobs, workers or available_cores(), progress.count)
    ordered = {name: one for name, one in told.items() if not isinstance(one, str)}
    for name, one in told.items():
        if isinstance(one, str):
            console.print(f"{name}: {one}", highlight=False)
    if not ordered:
        raise DataError(f"--data {data}: nothing to learn from")
    if joints == ARM:
        about += ", arm alone"
    costs = LearntCosts(ordered, LENGTH_M, about)
    costs.save(out / FILE, origin=origin)
    write_json(
        out / FIGURES,
        {"origin": origin, "cases": {name: one.scaled.tolist() for name, one in ordered.items()}},
    )
    (out / TEXT).write_text(report(costs, origin))
    draw_costs(out / PICTURE, costs)
    console.print(f"{out / FILE}: {', '.join(ordered)}", highlight=False, soft_wrap=True)


_Jobs = list[tuple[str, list[Session], list[RecordedSession]]]


def simulated_cases(names: Sequence[str], study: DyadStudy, people: int, seed: int) -> _Jobs:
    """The simulated sessions that some cases are learnt from: so many people in each position."""
    sessions = sessions_of(study, seed)
    found: _Jobs = []
    for name in names:
        own = [session for session in sessions if find_case(session.case).name == name]
        positions = {session.position for session in own}
        chosen = [
            session
            for position in sorted(positions)
            for session in [one for one in own if one.position == position][:people]
        ]
        found.append((name, chosen, []))
    return found


def _recorded(names: list[str], sessions: list[RecordedSession]) -> _Jobs:
    there = sorted({session.case for session in sessions})
    missing = [name for name in names if find_case(name).number not in there]
    if missing:
        raise DataError(
            f"no recording is of {', '.join(missing)}",
            expected="one of " + ", ".join(find_case(number).name for number in there),
        )
    wanted = names or [find_case(number).name for number in there]
    return [(name, [], [s for s in sessions if find_case(s.case).name == name]) for name in wanted]


def main() -> int:
    """Entry point."""
    app(prog_name="learn_costs.py")
    return 0
